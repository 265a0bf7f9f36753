"""Tables of recordings as arrays: NumPy's .npz, MATLAB's .mat, Parquet, and LeRobot folders.

Each format is read by its own library. Before memory is allocated, the declared sizes are compared with the size of
the file, and nothing is unpacked beyond a bound. Objects, structures and code are rejected.
"""

import struct
import zipfile
import zlib
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

import numpy as np

from affordance.arrays import Array
from affordance.exceptions import BadValueError, show_value
from affordance.extensions.payload.recording.run_table import RunTable
from affordance.files import bounded
from affordance.files.constraints import check_names

SUFFIXES = (".npz", ".mat", ".parquet")
# Largest number of bytes of numbers in one file, unpacked: twice the size of the largest file.
_MOST = 2 * bounded.RECORDING
_MOST_ARRAYS = 1000
# Size of the header of a MATLAB 5 file, [bytes], and the type of compressed elements.
_HEAD, _COMPRESSED = 128, 15
_NUMBERS = ("double", "single", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)))
_BATCH = 65_536  # rows of a Parquet file that are read at a time
_EFFORTS = ("effort", "torque", "current", "force", "wrench")


def read_arrays(path: Path) -> RunTable:
    """Reads a .npz, .mat or .parquet file.

    Raises:
        BadValueError: The file is not a table of numbers.
    """
    content = bounded.read_bytes(path, bounded.RECORDING)
    readers = {".npz": _read_npz, ".mat": _read_mat, ".parquet": _read_parquet}
    try:
        arrays = readers[path.suffix](path, content)
    except (BadValueError, MemoryError):
        raise
    except Exception as error:  # the libraries raise any exception on a damaged file
        first = (str(error).splitlines() or [""])[0][:100]
        raise BadValueError(path, "", f"is not a {path.suffix} file of numbers: {show_value(first)}") from error
    return _build_table(path, arrays)


def is_lerobot(path: Path) -> bool:
    """Returns whether a folder is a LeRobot data set."""
    return (path / "meta" / "info.json").is_file()


def read_lerobot(path: Path) -> RunTable:
    """Reads the first episode of a LeRobot folder.

    Raises:
        BadValueError: The data set has no torque, current or force, or no valid episode.
    """
    info = bounded.read_json(path / "meta" / "info.json")
    features = info.get("features") if isinstance(info, Mapping) else None
    if not isinstance(features, Mapping) or not features:
        raise BadValueError(path / "meta" / "info.json", "features", "is missing, must map names to features")
    if not any(word in str(name).lower() for name in features for word in _EFFORTS):
        names = ", ".join(str(name) for name in features)[:200]
        problem = f"is a LeRobot data set with {names}: without torques, currents or forces a load cannot be"
        raise BadValueError(path, "", f"{problem} identified; record joint efforts too, as observation.effort")
    files = sorted((path / "data").glob("*/*.parquet"))
    if not files:
        raise BadValueError(path, "data", "has no .parquet file")
    table = read_arrays(files[0])
    if "episode_index" in table.names:
        episode = table.values[:, table.names.index("episode_index")]
        rows = episode == episode[0]
        table = table._replace(values=table.values[rows], rows=table.rows[rows])
    return table._replace(names=tuple("time" if name == "timestamp" else name for name in table.names))


def _read_npz(path: Path, content: bytes) -> dict[str, Array]:
    arrays: dict[str, Array] = {}
    with zipfile.ZipFile(BytesIO(content)) as archive:
        members = archive.infolist()
        _check_size(path, sum(each.file_size for each in members), len(members))
        for member in members:
            name = member.filename.removesuffix(".npy")
            with archive.open(member) as file:
                version = np.lib.format.read_magic(file)
                read_head = (
                    np.lib.format.read_array_header_1_0
                    if version == (1, 0)
                    else (np.lib.format.read_array_header_2_0)
                )
                shape, _, dtype = read_head(file)
            if dtype.kind not in "fiu":
                raise BadValueError(path, name, f"holds {dtype}, must hold numbers")
            size = dtype.itemsize * float(np.prod(shape, dtype=float))
            if size > member.file_size:
                raise BadValueError(path, name, f"declares {size:.3g} bytes but has {member.file_size}")
            with archive.open(member) as file:
                arrays[name] = np.lib.format.read_array(file, allow_pickle=False).astype(float)
    return arrays


def _read_mat(path: Path, content: bytes) -> dict[str, Array]:
    from scipy.io import loadmat, whosmat  # imported here because few runs need it

    if content[:10] == b"MATLAB 7.3" or content[:4] == b"\x89HDF":
        raise BadValueError(path, "", "is a MATLAB 7.3 file, which is HDF5: save it with save(..., '-v7')")
    if content[:6] != b"MATLAB" or content[126:128] not in (b"IM", b"MI"):
        raise BadValueError(path, "", "is not a MATLAB 5 file: save it with save(..., '-v7')")
    whole = _unpack_mat(path, content)
    listed = whosmat(BytesIO(whole))
    for name, shape, kind in listed:
        if kind not in _NUMBERS:
            raise BadValueError(path, name, f"is of class {kind}, must be a matrix of numbers (save(..., '-struct'))")
        if float(np.prod(shape, dtype=float)) > len(whole):
            raise BadValueError(
                path, name, f"declares {np.prod(shape, dtype=float):.3g} numbers but has {len(whole)} bytes"
            )
    found = loadmat(BytesIO(whole), variable_names=[name for name, *_ in listed])
    arrays = {name: np.asarray(found[name]) for name, *_ in listed}
    for name, values in arrays.items():
        if values.dtype.kind not in "fiu":
            raise BadValueError(path, name, f"holds {values.dtype}, must hold real numbers")
    return {name: values.astype(float) for name, values in arrays.items()}


def _unpack_mat(path: Path, content: bytes) -> bytes:
    """Unpacks the compressed elements of a MATLAB 5 file, up to a bound."""
    order = "<" if content[126:128] == b"IM" else ">"
    parts, place, total, number = [content[:_HEAD]], _HEAD, 0, 0
    while place + 8 <= len(content):
        kind, size = struct.unpack(f"{order}II", content[place : place + 8])
        body = content[place + 8 : place + 8 + size]
        if kind == _COMPRESSED:
            body = zlib.decompressobj().decompress(body, _MOST + 1 - total)
            parts.append(body)
        else:
            parts.append(content[place : place + 8 + size])
        place, total, number = place + 8 + size, total + len(parts[-1]), number + 1
        _check_size(path, total, number)
    return b"".join(parts)


def _read_parquet(path: Path, content: bytes) -> dict[str, Array]:
    try:
        import pyarrow as arrow
        import pyarrow.parquet
    except ImportError as error:
        raise BadValueError(path, "", "needs pyarrow: install it with pip install '.[parquet]' in a clone") from error
    file = pyarrow.parquet.ParquetFile(BytesIO(content))
    kinds = {field.name: field.type for field in file.schema_arrow}
    kept = [name for name, kind in kinds.items() if _is_number(arrow, kind) or _is_list(arrow, kind)]
    if not kept:
        raise BadValueError(path, "", f"has no column of numbers among {', '.join(kinds)[:200]}")
    _check_size(path, 8 * file.metadata.num_rows * len(kept), len(kinds))
    parts: dict[str, list[Array]] = {name: [] for name in kept}
    total = 0
    for batch in file.iter_batches(_BATCH, columns=kept):
        total += batch.nbytes
        _check_size(path, total, len(kinds))
        for name in kept:
            column = batch.column(name)
            if column.null_count:
                raise BadValueError(path, name, f"lacks {column.null_count} values, must have one per row")
            if _is_list(arrow, column.type):
                flat = column.flatten().to_numpy(zero_copy_only=False).astype(float)
                if len(flat) % len(column):
                    raise BadValueError(path, name, "has lists of different lengths")
                parts[name].append(flat.reshape(len(column), -1))
            else:
                parts[name].append(column.to_numpy(zero_copy_only=False).astype(float))
    return {name: np.concatenate(each) for name, each in parts.items() if each}


def _is_number(arrow: object, kind: object) -> bool:
    types = arrow.types  # type: ignore[attr-defined]
    return bool(types.is_floating(kind) or types.is_integer(kind))


def _is_list(arrow: object, kind: object) -> bool:
    types = arrow.types  # type: ignore[attr-defined]
    is_list = types.is_list(kind) or types.is_fixed_size_list(kind)
    return bool(is_list and _is_number(arrow, kind.value_type))  # type: ignore[attr-defined]


def _check_size(path: Path, size: float, number: int) -> None:
    if size > _MOST:
        raise BadValueError(path, "", f"unpacks to more than {_MOST / 1e6:g} MB, must be smaller")
    if number > _MOST_ARRAYS:
        raise BadValueError(path, "", f"has {number} arrays, must have at most {_MOST_ARRAYS}")


def _build_table(path: Path, arrays: dict[str, Array]) -> RunTable:
    """Builds a table from arrays along time, in either orientation; constants are left out."""
    check_names(path, "columns", tuple(arrays))
    flat = {
        name: values.ravel() if max(values.shape, default=0) == values.size else values
        for name, values in arrays.items()
    }
    lengths = [len(values) for values in flat.values() if values.ndim and values.size > 1]
    if not lengths:
        raise BadValueError(path, "", "has no array of numbers along time")
    length = len(flat["time"]) if "time" in flat else max(set(lengths), key=lengths.count)
    columns = {}
    for name, values in flat.items():
        if values.ndim == 2 and values.shape[1] == length != values.shape[0]:
            values = values.T
        if values.ndim not in (1, 2) or len(values) != length:
            if values.size <= 1:
                continue  # a constant, such as the sampling rate
            problem = (
                f"has shape {arrays[name].shape}, must have the {length} samples of the others along one dimension"
            )
            raise BadValueError(path, name, problem)
        columns[name] = values
    table = RunTable.from_arrays(columns)
    if not np.isfinite(table.values).all():
        row, column = np.argwhere(~np.isfinite(table.values))[0]
        problem = f"is {table.values[row, column]}, must be finite"
        raise BadValueError(path, f"row {row + 1}, column {table.names[column]}", problem)
    return table
