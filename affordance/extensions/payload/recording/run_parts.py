"""Parts of one recording: files with the same columns and one clock, in order of time."""

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from affordance.exceptions import BadValueError
from affordance.extensions.payload.recording.run_table import RunTable
from affordance.files.bounded import RECORDING, suggest_file


def list_parts(description: Path, names: Sequence[str]) -> list[Path]:
    """Lists the files that a description names as parts of a recording, which must be in its own folder.

    Raises:
        BadValueError: A name is that of another folder, a file does not exist or is named twice, or the files are too
            large in total.
    """
    parts = [description.parent / name for name in names]
    for i, (name, part) in enumerate(zip(names, parts, strict=True)):
        key = f"files[{i}]"
        if Path(name).name != name:
            raise BadValueError(description, key, f"is {name!r}, must be the name of a file in the same folder")
        if not part.exists():
            raise BadValueError(description, key, f"is {name!r}, which does not exist{suggest_file(part)}")
        if name in names[:i]:
            raise BadValueError(description, key, f"is {name!r}, which is named twice")
    if (size := sum(part.stat().st_size for part in parts)) > RECORDING:
        problem = f"have {size / 1e6:.0f} MB in total, must have at most {RECORDING / 1e6:g} MB"
        raise BadValueError(description, "files", problem)
    return parts


def join_tables(parts: Sequence[Path], tables: Sequence[RunTable]) -> RunTable:
    """Joins the tables of all parts; rows are numbered continuously.

    Raises:
        BadValueError: A part has other columns than the first.
    """
    first, *others = tables
    for part, table in zip(parts[1:], others, strict=True):
        if (table.names, table.joint_names) != (first.names, first.joint_names):
            differing = [name for name in table.names if name not in first.names] or list(table.names)
            problem = f"differ from those of {parts[0].name}: are {', '.join(differing)[:200]}, must be the same"
            raise BadValueError(part, "columns", problem)
        if table.values.shape[1] != first.values.shape[1]:
            problem = f"are {table.values.shape[1]}, must be {first.values.shape[1]} as in {parts[0].name}"
            raise BadValueError(part, "columns", problem)
    if not others:
        return first
    before = itertools.accumulate((int(table.rows[-1]) if len(table.rows) else 0 for table in tables), initial=0)
    return RunTable(
        first.names,
        np.vstack([table.values for table in tables]),
        np.concatenate([start + table.rows for start, table in zip(before, tables, strict=False)]),
        sum(table.num_torn for table in tables),
        first.joint_names,
    )


def check_clock(parts: Sequence[Path], tables: Sequence[RunTable], time: int) -> None:
    """Checks by the time column that each part begins after the previous one ends.

    Raises:
        BadValueError: A part begins before the previous part ends.
    """
    times = [table.values[:, time] for table in tables]
    for (before, earlier), (part, later) in itertools.pairwise(zip(parts, times, strict=True)):
        if len(earlier) and len(later) and not later[0] > earlier[-1]:
            problem = f"begins at {later[0]:.6f}, must be later than the end of {before.name}, {earlier[-1]:.6f}"
            raise BadValueError(part, "time", f"{problem}: parts share one clock and are listed in order of time")
