"""Reads a run from a table and the YAML file that describes it (see ``run_entry``)."""

import itertools
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.extensions.payload.recording.run import (
    FEWEST_POSTURES,
    POSTURE_STEP,
    WRENCH_COLUMNS,
    Run,
    RunDescription,
)
from affordance.extensions.payload.recording.run_bag import read_bag
from affordance.extensions.payload.recording.run_entry import (
    COLUMN_MAPS,
    ColumnMap,
    RunEntry,
    build_column_map,
    name_columns,
)
from affordance.extensions.payload.recording.run_table import (
    ARRAYS,
    is_lerobot,
    read_arrays,
    read_lerobot,
    read_text,
)
from affordance.extensions.payload.settings import SignalKind
from affordance.files.bounded import suggest_file
from affordance.files.constraints import StrPath, check_names, check_path
from affordance.files.data_model import load_model

_DESCRIPTIONS = (".yaml", ".yml")
_BAGS = (".mcap", ".db3", ".bag")
# Column names of commanded quantities and of signals, which are not measured angles.
_NO_ANGLES = re.compile("action|command|cmd|target|desired|goal|tau|torque|effort|current|force", re.IGNORECASE)
_TIME = re.compile("time|stamp|^t$|sec", re.IGNORECASE)  # likely names of the time column
# Largest change of a joint angle of an arm at rest, due to droop under load or encoder noise, [rad].
_STILL = 5e-3
# Number of consecutive rows in one posture from which a table is a recording over time, with shorter stays as motion.
_STAY = 5
# Largest change of a joint angle between rows that is usual in a recording over time, [rad].
_APART = 0.05


def read_run(path: StrPath, description: StrPath | None = None) -> Run:
    """Reads a run from its table and description.

    Args:
        path: Table (.csv, .txt, .tsv, .npz or .parquet), ROS bag, LeRobot folder, or a description (.yaml) whose
            ``files`` are the parts of the recording.
        description: YAML file that describes the table; None for the file with the table's name and the suffix .yaml.

    Raises:
        BadValueError: A file or one of its values is wrong; the message names it.
    """
    path = check_path("path", path)
    description_file = path.with_suffix(".yaml") if description is None else check_path("description", description)
    if not path.exists():
        raise BadValueError(path, "", f"does not exist{suggest_file(path)}")
    if not description_file.exists():
        problem = (
            f"has no description: {description_file.name} in the same folder must state at least the joints and the "
            "signal, in two lines such as 'joints: [joint_1, joint_2]' and 'signal: joint_torque'"
        )
        raise BadValueError(path, "", problem)
    entry = load_model(description_file, RunEntry)
    is_split = path.suffix in _DESCRIPTIONS
    if bool(entry.files) != is_split:
        problem = f"must list the parts of a recording if {description_file.name} is given as the run, and only then"
        raise BadValueError(description_file, "files", problem)
    parts = _list_parts(path, entry.files) if is_split else [path]
    tables = [_read_table(part, description_file, entry) for part in parts]
    table = _join_tables(parts, tables)
    if joints := table.attrs.get("joints"):
        entry = entry.model_copy(update={"joints": entry.joints or list(joints), "columns": "standard"})
    if not entry.joints:
        raise BadValueError(
            description_file, "joints", "is missing: must list the joints in the order of the columns"
        )
    columns = _find_columns(parts[0], description_file, table, entry)
    if "time" in columns:
        _check_clock(parts, [part.to_numpy()[:, columns["time"]] for part in tables])
    kind = entry.signal or _guess_kind(path, columns)
    held = entry.postures is True or "time" not in columns
    return _build_run(path, table, columns, entry.build(entry.joints, kind, postures=held), entry)


def _list_parts(description: Path, names: Sequence[str]) -> list[Path]:
    """Lists the parts of a recording that are named in a description.

    The parts must be in the same folder as the description.
    """
    parts = [description.parent / name for name in names]
    for i, (name, part) in enumerate(zip(names, parts, strict=True)):
        if Path(name).name != name or not part.exists():
            problem = f"is {name!r}, must be the name of a file in the same folder{suggest_file(part)}"
            raise BadValueError(description, f"files[{i}]", problem)
    return parts


def _join_tables(parts: Sequence[Path], tables: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Joins the tables of all parts, with continuous row numbers."""
    first, *others = tables
    for part, table in zip(parts[1:], others, strict=True):
        if list(table.columns) != list(first.columns) or table.attrs != first.attrs:
            differing = [name for name in table.columns if name not in first.columns] or list(table.columns)
            problem = f"differ from those of {parts[0].name}: are {', '.join(differing)[:200]}, must be the same"
            raise BadValueError(part, "columns", problem)
    if not others:
        return first
    before = itertools.accumulate((int(table.index[-1]) if len(table) else 0 for table in tables), initial=0)
    rows = np.concatenate([start + table.index.to_numpy() for start, table in zip(before, tables, strict=False)])
    joined = pd.DataFrame(np.vstack([table.to_numpy() for table in tables]), index=rows, columns=first.columns)
    joined.attrs = first.attrs
    return joined


def _check_clock(parts: Sequence[Path], times: Sequence[Array]) -> None:
    """Checks that each part begins after the end of the previous part. Times have shape (N,) each."""
    for (before, earlier), (part, later) in itertools.pairwise(zip(parts, times, strict=True)):
        if len(earlier) and len(later) and not later[0] > earlier[-1]:
            problem = f"begins at {later[0]:.6f}, must be later than the end of {before.name}, {earlier[-1]:.6f}"
            raise BadValueError(part, "time", f"{problem}: parts share one clock and are listed in order of time")


def _read_table(path: Path, description_file: Path, entry: RunEntry) -> pd.DataFrame:
    """Reads the table of a recording or of one part."""
    if is_lerobot(path):
        table = read_lerobot(path)
    elif path.suffix in ARRAYS:
        table = read_arrays(path)
    elif path.is_dir() or path.suffix in _BAGS:
        if entry.signal is None:
            problem = "is missing: the efforts in a bag may be joint_torque, motor_torque or current"
            raise BadValueError(description_file, "signal", problem)
        table = read_bag(path, entry.topic, entry.wrench_topic, is_current=entry.signal is SignalKind.CURRENT)
    else:
        table = read_text(path, entry.skip_rows)
    check_names(path, "columns", (*table.columns, *table.attrs.get("joints", ())))
    return table


def _find_columns(path: Path, description_file: Path, table: pd.DataFrame, entry: RunEntry) -> dict[str, int]:
    """Finds the position of each standard column in the table."""
    names = tuple(table.columns)
    if isinstance(entry.columns, tuple):
        names = entry.columns
        if len(names) != table.shape[1]:
            problem = f"lists {len(names)} names, must list the {table.shape[1]} columns of {path.name}"
            raise BadValueError(description_file, "columns", problem)
    elif not any(names):
        problem = "contains no column names; the description must list them under columns"
        raise BadValueError(path, "row 1", problem)
    ours = name_columns(names, _get_map(entry))
    columns: dict[str, int] = {}
    for place, name in enumerate(ours):
        if name is not None:
            columns.setdefault(name, place)  # newer logs repeat the commanded q_d: the first counts
    angles = [f"q_{i + 1}" for i in range(len(entry.joints))]
    for name in (*angles, "time"):
        if name not in columns:
            if name == "time" and (entry.postures or _are_postures(table, columns, angles, names, entry)):
                continue
            problem = f"is missing: has {', '.join(names)[:200]}{_suggest_columns(name, names, len(entry.joints))}"
            raise BadValueError(path, f"column {name}", problem)
    extra = f"q_{len(entry.joints) + 1}"
    if extra in columns:
        problem = f"has {extra}, must have as many joints as the {len(entry.joints)} of {description_file.name}"
        raise BadValueError(path, f"column {extra}", problem)
    return columns


def _are_postures(
    table: pd.DataFrame, columns: Mapping[str, int], angles: Sequence[str], names: Sequence[str], entry: RunEntry
) -> bool:
    """Returns True if each row of a table without times is a separate posture."""
    if entry.postures is False or any(_TIME.search(name) for name in names) or "v_1" in columns:
        return False
    return _looks_held(entry.units.q * table.to_numpy()[:, [columns[name] for name in angles]])


def _suggest_columns(missing: str, names: Sequence[str], num: int) -> str:
    """Suggests a line for the description that maps columns of the log to a missing column."""
    if missing == "time":
        likely = [name for name in names if _TIME.search(name)]
        if not likely:
            return "; a table of held postures needs none if the description has 'postures: true'"
        return f"""; list another name under columns, as in 'columns: {{time: {likely[0]}}}'"""
    stems = Counter(re.sub(r"\d+", "{}", name, count=1) for name in names if re.search(r"\d", name))
    numbered = [stem for stem, count in stems.items() if count == num and not _NO_ANGLES.search(stem)]
    likely = [stem for stem in numbered if re.search("pos|ang|q", stem, re.IGNORECASE)] or numbered
    return f"""; list other names under columns, as in 'columns: {{q: "{likely[0]}"}}'""" if likely else ""


def _describe_missing_signal(kind: SignalKind, columns: Mapping[str, int], num: int) -> str:
    """Describes the missing columns of a signal, and the kind of signal that the table contains instead."""
    name = "current" if kind is SignalKind.CURRENT else "tau"
    wanted = ", ".join(WRENCH_COLUMNS) if kind is SignalKind.WRENCH else f"{name}_1 to {name}_{num}"
    fitting = {"tau_1": "joint_torque or signal: motor_torque", "current_1": "current", "fx": "wrench"}
    has = [f"has {name}, which fits signal: {words}" for name, words in fitting.items() if name in columns]
    others = f"; {', '.join(has)}" if has else ""
    return f"has no columns of the signal {kind.value}, must have {wanted}{others}"


def _get_map(entry: RunEntry) -> ColumnMap:
    """Returns the column map of the logger, or one built from the description."""
    if isinstance(entry.columns, dict):
        return build_column_map(entry.columns)
    return COLUMN_MAPS[entry.columns if isinstance(entry.columns, str) else "standard"]


def _guess_kind(path: Path, columns: dict[str, int]) -> SignalKind:
    kinds = {"tau_1": SignalKind.JOINT_TORQUE, "current_1": SignalKind.CURRENT, "fx": SignalKind.WRENCH}
    found = [kind for name, kind in kinds.items() if name in columns]
    if len(found) != 1:
        problem = "no signal" if not found else "several signals"
        raise BadValueError(
            path, "columns", f"has {problem}, must have tau_1.., current_1.. or fx..tz, or a key signal"
        )
    return found[0]


def _build_run(
    path: Path, table: pd.DataFrame, columns: dict[str, int], description: RunDescription, entry: RunEntry
) -> Run:
    num = len(entry.joints)

    def take(quantity: str, names: tuple[str, ...] | None = None) -> Array | None:
        names = names or tuple(f"{quantity}_{i + 1}" for i in range(num))
        given = [name for name in names if name in columns]
        if not given:
            return None
        if len(given) < len(names):
            missing = next(name for name in names if name not in columns)
            raise BadValueError(path, f"column {missing}", f"is missing, although there are {', '.join(given)}")
        unit: float = getattr(entry.units, quantity)
        return table.to_numpy()[:, [columns[name] for name in names]] * unit

    kind = description.kind
    if kind is SignalKind.WRENCH:
        signal = take("wrench", WRENCH_COLUMNS)
        signal = None if signal is None else entry.force_on * signal
    else:
        signal = take("current" if kind is SignalKind.CURRENT else "tau")
    if signal is None:
        raise BadValueError(path, "columns", _describe_missing_signal(kind, columns, num))
    q = take("q")
    assert q is not None  # _find_columns
    if description.postures:
        return _build_postures(path, table, description, q, signal)
    times = table.to_numpy()[:, columns["time"]] * (
        _get_map(entry).time_unit if entry.units.time is None else entry.units.time
    )
    return Run(str(path), description, times, q, signal, take("v"), take("vdot"), rows=table.index.to_numpy())


def _build_postures(path: Path, table: pd.DataFrame, description: RunDescription, q: Array, signal: Array) -> Run:
    """Builds the run of held postures from the mean signal of each posture.

    Consecutive rows with the same joint angles are averaged. If the longest stay has at least five rows, stays
    of fewer than five rows count as motion and are left out.
    """
    if not len(q):
        raise BadValueError(path, "", f"has no rows, must have at least {FEWEST_POSTURES} postures")
    starts = [0]
    for row in range(1, len(q)):
        if np.abs(q[row] - q[starts[-1]]).max() > _STILL:
            starts.append(row)
    first = np.array(starts)
    lengths = np.diff(np.append(first, len(q)))
    kept = lengths >= _STAY if lengths.max() >= _STAY else lengths > 0
    means = (np.add.reduceat(np.hstack([q, signal]), first, axis=0) / lengths[:, None])[kept]
    notes: tuple[str, ...] = ()
    if len(means) < len(q):
        moving = int(lengths[~kept].sum())
        moved = f", {moving} rows in motion are left out" if moving else ""
        notes = (f"{len(q)} rows show {len(means)} postures{moved}",)
    times = np.linspace(0.0, POSTURE_STEP * (len(means) - 1), len(means))
    num, rows = q.shape[1], table.index.to_numpy()[first[kept]]
    return Run(str(path), description, times, means[:, :num], means[:, num:], rows=rows, notes=notes)


def _looks_held(q: Array) -> bool:
    """Returns True if the rows of a table without times are separate postures, mostly far apart."""
    return len(q) >= FEWEST_POSTURES and bool(np.median(np.abs(np.diff(q, axis=0)).max(axis=1)) > _APART)
