"""Reads tables of recordings: CSV, NumPy's .npz, Parquet, and LeRobot folders.

The result is a data frame of numbers with one row per sample. Its index is the row number in the file, from 1.
"""

import zipfile
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from affordance.arrays import Array
from affordance.exceptions import BadValueError, show_value
from affordance.files import bounded
from affordance.files.constraints import check_names
from affordance.files.text_table import read_table

ARRAYS = (".npz", ".parquet")  # suffixes of array files
_EFFORTS = ("effort", "torque", "current", "force", "wrench")


def read_text(path: Path, skipped: int = 0) -> pd.DataFrame:
    """Reads a text table. Column names are empty if there is no header line.

    Raises:
        BadValueError: The file cannot be read, or a row is incomplete or contains text; the message names the row.
    """
    table = read_table(path, skipped, "skip_rows: N skips N rows above a table")
    return pd.DataFrame(table.values, table.rows, table.names)


def read_arrays(path: Path) -> pd.DataFrame:
    """Reads a .npz or .parquet file. The columns of a matrix are named NAME_1, NAME_2 and so on.

    Raises:
        BadValueError: The file is not a table of numbers, or is too large when unpacked.
    """
    bounded.check_size(path, bounded.RECORDING)
    read = _read_npz if path.suffix == ".npz" else _read_parquet
    try:
        arrays = read(path)
    except BadValueError:
        raise
    except Exception as error:  # the libraries raise any exception on a damaged file
        first = (str(error).splitlines() or [""])[0][:100]
        raise BadValueError(path, "", f"is not a {path.suffix} file of numbers: {show_value(first)}") from error
    check_names(path, "columns", tuple(arrays))
    sampled = {name: values for name, values in arrays.items() if values.size > 1}  # no scalars, such as the rate
    lengths = Counter(len(values) for values in sampled.values())
    if not lengths:
        raise BadValueError(path, "", "has no array of numbers along time")
    length = lengths.most_common(1)[0][0]
    columns: dict[str, Array] = {}
    for name, values in sampled.items():
        if len(values) != length or values.ndim > 2:
            problem = (
                f"has shape {values.shape}, must have the {length} samples of the others along its first dimension"
            )
            raise BadValueError(path, name, problem)
        if values.ndim == 1:
            columns[name] = values
        else:
            columns |= {f"{name}_{i + 1}": column for i, column in enumerate(values.T)}
    return build_frame(columns)


def build_frame(columns: Mapping[str, Array]) -> pd.DataFrame:
    """Builds a table from columns with shape (N,) each."""
    frame = pd.DataFrame(dict(columns), dtype=float)
    frame.index += 1
    return frame


def is_lerobot(path: Path) -> bool:
    """Returns True if a folder is a LeRobot data set."""
    return (path / "meta" / "info.json").is_file()


def read_lerobot(path: Path) -> pd.DataFrame:
    """Reads the first episode of a LeRobot folder.

    Raises:
        BadValueError: The data set has no torque, current or force, or no valid episode.
    """
    files = sorted((path / "data").glob("*/*.parquet"))
    if not files:
        raise BadValueError(path, "data", "has no .parquet file")
    frame = read_arrays(files[0]).rename(columns={"timestamp": "time"})
    names = ", ".join(map(str, frame))
    if not any(word in names.lower() for word in _EFFORTS):
        problem = f"is a LeRobot data set with {names[:200]}: without torques, currents or forces a load"
        raise BadValueError(path, "", f"{problem} cannot be identified; record joint efforts, as observation.effort")
    if "episode_index" in frame:
        frame = frame[frame["episode_index"] == frame["episode_index"].iloc[0]]
    return frame


def check_unpacked(path: Path, size: float) -> None:
    """Checks the unpacked size of a file, [bytes].

    Raises:
        BadValueError: The size exceeds the largest size of a recording.
    """
    if size > bounded.RECORDING:
        problem = f"unpacks to {size / 1e6:.3g} MB, must be at most {bounded.RECORDING / 1e6:g} MB"
        raise BadValueError(path, "", problem)


def _read_npz(path: Path) -> dict[str, Array]:
    with zipfile.ZipFile(path) as archive:
        check_unpacked(path, sum(each.file_size for each in archive.infolist()))
    with np.load(path, allow_pickle=False) as arrays:
        return {name: np.asarray(values, dtype=float) for name, values in arrays.items()}


def _read_parquet(path: Path) -> dict[str, Array]:
    try:
        from pyarrow import parquet
    except ImportError as error:
        raise BadValueError(path, "", "needs pyarrow: install it with pip install '.[parquet]' in a clone") from error
    file = parquet.ParquetFile(path)
    groups = [file.metadata.row_group(i) for i in range(file.metadata.num_row_groups)]
    check_unpacked(path, sum(8 * group.column(j).num_values for group in groups for j in range(group.num_columns)))
    frame = file.read().to_pandas()
    arrays: dict[str, Array] = {}
    for name in frame:
        lists = frame[name].dtype == object and not isinstance(frame[name].iloc[0], str)
        if lists or pd.api.types.is_numeric_dtype(frame[name].dtype):  # texts such as the task's name are left out
            arrays[name] = np.asarray(np.stack(list(frame[name])) if lists else frame[name], dtype=float)
    for name, values in arrays.items():
        if not np.isfinite(values).all():
            raise BadValueError(path, name, "lacks a value, must have one finite number per row")
    return arrays
