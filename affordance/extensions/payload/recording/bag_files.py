"""Storage of ROS bags: topics and encoded messages of SQLite and MCAP files (ROS 2) and of ROS 1 bags.

The first bytes of a file determine its format, as its name comes from a stranger's metadata. SQLite files are read
here, because rosbags would execute computed columns, and open another file if a name contains URL escapes; rosbags
reads the other formats. Compressed content may unpack to the size of a recording.
"""

import bz2
import importlib
import sqlite3
import sys
from array import array
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager
from io import BytesIO
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import IO, Any, NamedTuple

import numpy as np

from affordance.exceptions import BadValueError, show_value, suggest
from affordance.extensions.payload.recording.plain_database import check_plain_tables, limit_steps
from affordance.files.bounded import RECORDING, check_size, read_yaml

# First bytes of each file format.
_SQLITE, _MCAP, _ROS1, _ZSTD = b"SQLite format 3\0", b"\x89MCAP0\r\n", b"#ROSBAG V2.0\n", b"\x28\xb5\x2f\xfd"
_HEAD = 16
_METADATA, _LIST = "metadata.yaml", "rosbag2_bagfile_information.relative_file_paths"
# Zstandard is part of Python from 3.14 on; for earlier versions rosbags installs it.
_ZSTD_MODULE = "compression.zstd" if sys.version_info >= (3, 14) else "backports.zstd"
_LEAST_ROW = 8  # least size of an SQLite row with three columns, with its pointer, [bytes]
_BLOCK = 1 << 20  # number of bytes that are unpacked at a time
_MB = 1_000_000

type _Opener = Callable[[IO[bytes]], IO[bytes]]


class Storage(NamedTuple):
    """Open file of a bag.

    Attributes:
        topics: Name of each topic, and the type of its messages.
        read: Reads the encoded messages of a topic in order of reception, each with its time, [ns].
        is_ros1: True if messages are encoded as in ROS 1.
    """

    topics: tuple[tuple[str, str], ...]
    read: Callable[[str], Iterator[tuple[int, bytes]]]
    is_ros1: bool = False


class _Volume:
    """Counter of bytes, which raises a BadValueError above the largest size of a recording."""

    def __init__(self, path: Path, what: str) -> None:
        self._path, self._what, self._total = path, what, 0

    def count(self, content: bytes) -> bytes:
        """Counts bytes and returns them."""
        self._total += len(content)
        if self._total > RECORDING:
            raise BadValueError(
                self._path, "", f"{self._what} more than {RECORDING / _MB:g} MB, which is the most allowed"
            )
        return content

    def unpack(self, packed: IO[bytes]) -> bytes:
        """Reads a compressed file to its end, and counts the unpacked bytes."""
        with packed:
            return b"".join(iter(lambda: self.count(packed.read(_BLOCK)), b""))


class _Bounds(NamedTuple):
    """Counters of the unpacked bytes of a bag's compressed parts, and of the bytes of its messages."""

    unpacked: _Volume
    messages: _Volume

    def count_message(self, content: bytes) -> bytes:
        """Counts a message, unpacks it if it is compressed, and returns it."""
        if content.startswith(_ZSTD):
            return self.messages.unpack(_open_zstd(BytesIO(content)))
        return self.messages.count(content)


@contextmanager
def open_bag(path: Path) -> Iterator[list[Storage]]:
    """Opens a bag: a storage file, or a folder whose metadata lists such files in order.

    Raises:
        BadValueError: The bag cannot be opened, is too large, contains computed columns, or names files outside its
            folder.
        Exception: The bag is damaged; any exception may be raised, also while the bag is read.
    """
    files = _list_files(path) if path.is_dir() else [path]
    for file in files:
        check_size(file, RECORDING)
    if sum(file.stat().st_size for file in files) > RECORDING:
        raise BadValueError(path, "", f"has files of more than {RECORDING / _MB:g} MB, which is the most allowed")
    bounds = _Bounds(_Volume(path, "unpacks to"), _Volume(path, "has messages of"))
    with ExitStack() as stack:
        yield [stack.enter_context(_open_storage(file, bounds)) for file in files]


def _list_files(folder: Path) -> list[Path]:
    """Lists the files that a bag's metadata names.

    Raises:
        BadValueError: The metadata names no files, or a file that is not in the bag's folder.
    """
    metadata = folder / _METADATA
    content = read_yaml(metadata)
    try:
        names = content["rosbag2_bagfile_information"]["relative_file_paths"]
    except (KeyError, TypeError) as error:
        raise BadValueError(metadata, _LIST, "is missing, must list the bag's files") from error
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        raise BadValueError(metadata, _LIST, f"is {show_value(names)}, must be a list of file names")
    files: list[Path] = []
    for i, name in enumerate(names):
        last = PurePath(name).name  # some versions of ROS prepend the bag's folder
        if problem := _find_problem(last, folder, files):
            raise BadValueError(metadata, f"{_LIST}[{i}]", f"is {show_value(name)}, {problem}")
        files.append(folder / last)
    return files


def _find_problem(name: str, folder: Path, others: list[Path]) -> str:
    """Returns why a file is not accepted as part of a bag; an empty text if it is."""
    file = folder / name
    if not name or not file.exists() or file.is_dir():
        known = [each.name for each in folder.iterdir() if each.name != _METADATA]
        return f"which is not a file in the bag's folder{suggest(name, known)}"
    if file.resolve().parent != folder.resolve():
        return "a link that leads out of the bag's folder"
    return "which is listed twice" if file in others else ""


@contextmanager
def _open_storage(file: Path, bounds: _Bounds, *, may_be_packed: bool = True) -> Iterator[Storage]:
    """Opens a storage file whose format follows from its first bytes."""
    kinds: dict[bytes, Callable[[Path, _Bounds], AbstractContextManager[Storage]]] = {
        _SQLITE: _open_sqlite,
        _MCAP: _open_mcap,
        _ROS1: _open_ros1,
    }
    if may_be_packed:
        kinds[_ZSTD] = _open_packed
    with file.open("rb") as opened:
        head = opened.read(_HEAD)
    for first, open_kind in kinds.items():
        if head.startswith(first):
            with open_kind(file, bounds) as storage:
                yield storage
            return
    problem = f"it begins with {head!r}" if head else "it is empty"
    raise BadValueError(file, "", f"cannot be read as a ROS bag: {problem}, must begin like SQLite, MCAP or ROS 1")


@contextmanager
def _open_packed(file: Path, bounds: _Bounds) -> Iterator[Storage]:
    """Unpacks a compressed storage file into a temporary folder, and opens it."""
    with TemporaryDirectory() as folder:
        unpacked = Path(folder) / file.stem
        with unpacked.open("wb") as out, file.open("rb") as opened, _open_zstd(opened) as packed:
            while block := packed.read(_BLOCK):
                out.write(bounds.unpacked.count(block))
        try:
            with _open_storage(unpacked, bounds, may_be_packed=False) as storage:
                yield storage
        except BadValueError as error:  # the message must name the file that the user knows
            raise BadValueError(
                file if error.source == unpacked else error.source, error.key, error.problem
            ) from error


@contextmanager
def _open_sqlite(file: Path, bounds: _Bounds) -> Iterator[Storage]:
    check_plain_tables(file, "ROS bag", is_immutable=True)
    most_rows = file.stat().st_size // _LEAST_ROW
    with closing(sqlite3.connect(f"{file.absolute().as_uri()}?mode=ro&immutable=1", uri=True)) as database:
        limit_steps(database)

        def fetch(query: str) -> Iterator[Any]:
            for number, row in enumerate(database.execute(query)):
                if number > most_rows:  # pages of a damaged file may refer to each other without end
                    raise BadValueError(
                        file, "", f"has more than {most_rows} rows, more than a file of its size can contain"
                    )
                yield row

        topics = {i: (str(name), str(kind)) for i, name, kind in fetch("SELECT id, name, type FROM topics")}

        def read(topic: str) -> Iterator[tuple[int, bytes]]:
            # Times are sorted here because SQLite would sort them together with the messages.
            ids = {i for i, (name, _) in topics.items() if name == topic}
            times, rows = array("q"), array("q")
            for i, time, row in fetch("SELECT topic_id, timestamp, rowid FROM messages"):
                if i in ids:
                    times.append(time)
                    rows.append(row)
            for k in np.argsort(np.array(times), kind="stable"):
                found = database.execute("SELECT data FROM messages WHERE rowid = ?", (rows[k],)).fetchone()
                if not found or not isinstance(found[0], bytes):
                    raise BadValueError(file, "messages", "has a row without data, must have an encoded message")
                yield times[k], bounds.count_message(found[0])

        yield Storage(tuple(topics.values()), read)


@contextmanager
def _open_mcap(file: Path, bounds: _Bounds) -> Iterator[Storage]:
    library = importlib.import_module("rosbags.rosbag2.storage_mcap")
    with _bounded(library.DECOMPRESSORS, bounds), _opened(library.McapReader(file)) as reader:
        yield _adapt(reader, bounds, is_ros1=False)


@contextmanager
def _open_ros1(file: Path, bounds: _Bounds) -> Iterator[Storage]:
    library = importlib.import_module("rosbags.rosbag1.reader")
    size = file.stat().st_size

    class Reader(library.Reader):  # type: ignore[misc,name-defined]
        """Reader that rejects an index larger than the file, which would refer to the same parts repeatedly."""

        num_read = 0

        def read_index_data(self, *arguments: Any) -> None:
            begin = self.bio.tell()
            super().read_index_data(*arguments)
            self.num_read += self.bio.tell() - begin
            if self.num_read > size:
                raise BadValueError(file, "", "has an index that is larger than the file")

    with _bounded(library.decompressors, bounds), _opened(Reader(file)) as reader:
        yield _adapt(reader, bounds, is_ros1=True)


def _adapt(reader: Any, bounds: _Bounds, *, is_ros1: bool) -> Storage:
    """Wraps an open reader of rosbags as a storage."""

    def read(topic: str) -> Iterator[tuple[int, bytes]]:
        connections = [each for each in reader.connections if each.topic == topic]
        for _, time, content in reader.messages(connections) if connections else ():
            yield time, bounds.count_message(content)

    return Storage(tuple((each.topic, each.msgtype) for each in reader.connections), read, is_ros1)


@contextmanager
def _opened(reader: Any) -> Iterator[Any]:
    reader.open()  # on failure the reader closes itself
    with closing(reader):
        yield reader


@contextmanager
def _bounded(decompressors: dict[str, Callable[..., bytes]], bounds: _Bounds) -> Iterator[None]:
    """Replaces rosbags' decompressors, by name, with functions that count what they unpack."""
    openers: dict[str, _Opener] = {"zstd": _open_zstd, "lz4": _open_lz4, "bz2": _open_bz2}
    theirs = dict(decompressors)
    for name in theirs:
        decompressors[name] = _count_unpacked(openers.get(name, lambda packed: packed), bounds)
    try:
        yield
    finally:
        decompressors.update(theirs)


def _count_unpacked(opener: _Opener, bounds: _Bounds) -> Callable[..., bytes]:
    return lambda packed, *_: bounds.unpacked.unpack(opener(BytesIO(packed)))


def _open_zstd(packed: IO[bytes]) -> IO[bytes]:
    opened: IO[bytes] = importlib.import_module(_ZSTD_MODULE).open(packed, "rb")
    return opened


def _open_lz4(packed: IO[bytes]) -> IO[bytes]:
    opened: IO[bytes] = importlib.import_module("lz4.frame").open(packed, "rb")
    return opened


def _open_bz2(packed: IO[bytes]) -> IO[bytes]:
    return bz2.open(packed, "rb")
