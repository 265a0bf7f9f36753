"""Storage files of strangers' bags: known by content, in the bag's folder only, of bounded size once unpacked."""

import os
import sqlite3
import struct
from contextlib import closing

import numpy as np
import pytest
from helpers.refusals import refuse

from affordance.extensions.payload.recording import bag_files, plain_database
from affordance.extensions.payload.recording.run_bag import JOINT_STATES, read_bag

pytest.importorskip("rosbags")
from backports import zstd
from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_typestore

TABLES = "CREATE TABLE topics(id, name, type); CREATE TABLE messages(id, topic_id, timestamp, data);"
FOREVER = "CREATE VIEW schema AS WITH RECURSIVE a(x) AS (SELECT 1 UNION ALL SELECT x FROM a) SELECT x FROM a;"
METADATA = "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n  relative_file_paths: {}\n"
SECONDS = (1, 2, 3)


def encode(second, padding=0, store=Stores.ROS2_HUMBLE):
    """A joint's state, encoded, with so many letters in the name of its frame."""
    types = get_typestore(store)
    State, Header, Time = (
        types.types[name] for name in (JOINT_STATES, "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    )
    frame = "x" * padding
    head = Header(0, Time(second, 0), frame) if store is Stores.ROS1_NOETIC else Header(Time(second, 0), frame)
    message = State(head, ["a"], np.array([0.1 * second]), np.array([]), np.array([]))
    serialize = types.serialize_ros1 if store is Stores.ROS1_NOETIC else types.serialize_cdr
    return bytes(serialize(message, JOINT_STATES))


def write_sqlite(path, messages, statements=TABLES, topics=(1,)):
    with closing(sqlite3.connect(path)) as database:
        database.executescript(statements)
        database.executemany("INSERT INTO topics VALUES (?, '/j', ?)", [(i, JOINT_STATES) for i in topics])
        rows = [(number, 1, number, message) for number, message in enumerate(messages)]
        database.executemany("INSERT INTO messages VALUES (?, ?, ?, ?)", rows)
        database.commit()


def write_bag(folder, *names):
    """A folder whose metadata lists files."""
    folder.mkdir(exist_ok=True)
    (folder / "metadata.yaml").write_text(METADATA.format([str(name) for name in names]), encoding="utf-8")
    return folder


def write_mcap(path, messages, compression=None):
    writer = rosbag2.Writer(path, version=9, storage_plugin=rosbag2.StoragePlugin.MCAP)
    if compression is not None:
        writer.set_compression(compression, rosbag2.CompressionFormat.ZSTD)
    with writer:
        states = writer.add_connection("/j", JOINT_STATES, typestore=get_typestore(Stores.ROS2_HUMBLE))
        for second, message in enumerate(messages, start=1):
            writer.write(states, second * 10**9, message)
    return path


def write_ros1(path, messages, compression):
    writer = rosbag1.Writer(path)
    if compression is not None:
        writer.set_compression(compression)
    with writer:
        states = writer.add_connection("/j", JOINT_STATES, typestore=get_typestore(Stores.ROS1_NOETIC))
        for second, message in enumerate(messages, start=1):
            writer.write(states, second * 10**9, message)
    return path


def check_states(path):
    """Asserts that the three states are read."""
    table = read_bag(path)
    assert table.names == ("time", "q_1")
    np.testing.assert_allclose(table.values, [[second, 0.1 * second] for second in SECONDS])


@pytest.mark.parametrize("name", ["bag.sqlite", "bag.txt", "bag.mcap", "bag", "bag.db3.zstd", "bag.bag"])
def test_a_database_that_calculates_is_refused_whatever_its_name(tmp_path, name):
    bag = write_bag(tmp_path / "bag", name)
    write_sqlite(bag / name, [], TABLES + FOREVER)
    assert f"{name}: calculates 'schema', must be a database of plain tables" in refuse(read_bag, bag)


def test_a_packed_database_that_calculates_is_refused(tmp_path):
    bag = write_bag(tmp_path / "bag", "bag.db3.zstd")
    write_sqlite(bag / "bag.db3", [], TABLES + FOREVER)
    (bag / "bag.db3.zstd").write_bytes(zstd.compress((bag / "bag.db3").read_bytes()))
    (bag / "bag.db3").unlink()
    assert "bag.db3.zstd: calculates 'schema', must be a database of plain tables" in refuse(read_bag, bag)


@pytest.mark.parametrize("name", ["bag.db3", "bag.sqlite", "of ours", "b?mode=rwc", "b#c", "..%2Fother.db3"])
def test_a_plain_database_is_read_whatever_its_name(tmp_path, name):
    """Also with escapes of URLs, by which SQLite would open another file."""
    bag = write_bag(tmp_path / "bag", name)
    write_sqlite(tmp_path / "other.db3", [], TABLES + FOREVER)
    write_sqlite(bag / name, map(encode, SECONDS))
    check_states(bag)


def test_packed_files_and_packed_messages_are_read(tmp_path):
    bag = write_bag(tmp_path / "bag", "bag.db3.zstd")
    write_sqlite(tmp_path / "bag.db3", [zstd.compress(encode(second)) for second in SECONDS])
    (bag / "bag.db3.zstd").write_bytes(zstd.compress((tmp_path / "bag.db3").read_bytes()))
    check_states(bag)


@pytest.mark.parametrize("compression", [None, rosbag2.CompressionMode.STORAGE])
def test_mcap_of_another_name_is_read(tmp_path, compression):
    written = write_mcap(tmp_path / "written", map(encode, SECONDS), compression)
    bag = write_bag(tmp_path / "bag", "bag.db3")
    (written / "written.mcap").rename(bag / "bag.db3")
    check_states(bag)


@pytest.mark.parametrize("compression", [None, *rosbag1.Writer.CompressionFormat])
def test_bags_of_ros_1_are_read(tmp_path, compression):
    messages = [encode(second, store=Stores.ROS1_NOETIC) for second in SECONDS]
    check_states(write_ros1(tmp_path / "bag.bag", messages, compression))


def test_messages_of_a_bag_in_parts_are_in_their_order(tmp_path):
    bag = write_bag(tmp_path / "bag", "bag_0.db3", "bag/bag_1.db3")
    write_sqlite(bag / "bag_0.db3", [encode(1)])
    write_sqlite(bag / "bag_1.db3", [encode(2), encode(3)])
    check_states(bag)


@pytest.mark.parametrize(
    ("names", "problem"),
    [
        (["../other.db3"], "[0]: is '../other.db3', which is not a file in the bag's folder"),
        (["/dev/zero"], "[0]: is '/dev/zero', which is not a file in the bag's folder"),
        (["bag.db3", "out.db3"], "[1]: is 'out.db3', a link that leads out of the bag's folder"),
        (["device"], "[0]: is 'device', a link that leads out of the bag's folder"),
        (["bag.db3", "x/bag.db3"], "[1]: is 'x/bag.db3', which is listed twice"),
        (["bg.db3"], "which is not a file in the bag's folder; did you mean 'bag.db3'?"),
        ([".."], "[0]: is '..', which is not a file in the bag's folder"),
        ([""], "[0]: is '', which is not a file in the bag's folder"),
        ([], ": is [], must be a list of file names"),
    ],
)
def test_metadata_that_names_other_files_is_refused(tmp_path, names, problem):
    bag = write_bag(tmp_path / "bag", *names)
    write_sqlite(bag / "bag.db3", map(encode, SECONDS))
    write_sqlite(tmp_path / "other.db3", map(encode, SECONDS))
    (bag / "out.db3").symlink_to(tmp_path / "other.db3")
    (bag / "device").symlink_to("/dev/zero")
    assert problem in refuse(read_bag, bag)


def test_a_pipe_in_a_bag_is_refused(tmp_path):
    os.mkfifo(write_bag(tmp_path / "bag", "bag.db3") / "bag.db3")
    assert "bag.db3: cannot be read: it is a device, a pipe or a socket" in refuse(read_bag, tmp_path / "bag")


@pytest.mark.parametrize("text", ["a: 1", "rosbag2_bagfile_information: 1", "[]", METADATA.format("{a: 1}")])
def test_metadata_without_files_is_refused(tmp_path, text):
    (tmp_path / "metadata.yaml").write_text(text, encoding="utf-8")
    assert "metadata.yaml: rosbag2_bagfile_information.relative_file_paths: is " in refuse(read_bag, tmp_path)


@pytest.mark.parametrize("content", [b"", b"SQLite format 4\0", b"\x7fELF", b"PK\x03\x04", b"time,q_1\n1,2\n"])
def test_what_is_no_storage_file_is_refused(tmp_path, content):
    (tmp_path / "bag.db3").write_bytes(content)
    assert "must begin like SQLite, MCAP or ROS 1" in refuse(read_bag, tmp_path / "bag.db3")


# What unfolds to a megabyte and a half, from some kilobytes.
@pytest.fixture
def small_bound(monkeypatch):
    monkeypatch.setattr(bag_files, "RECORDING", 1_000_000)


LARGE = [encode(second, 500_000) for second in SECONDS]
LARGE_OF_ROS1 = [encode(second, 500_000, Stores.ROS1_NOETIC) for second in SECONDS]


@pytest.mark.usefixtures("small_bound")
def test_a_packed_file_that_unfolds_beyond_the_bound_is_refused(tmp_path):
    bag = write_bag(tmp_path / "bag", "bag.db3")
    write_sqlite(tmp_path / "bag.db3", LARGE)
    (bag / "bag.db3").write_bytes(zstd.compress((tmp_path / "bag.db3").read_bytes()))
    assert "bag: unpacks to more than 1 MB, which is the most allowed" in refuse(read_bag, bag)


@pytest.mark.usefixtures("small_bound")
def test_packed_messages_that_unfold_beyond_the_bound_are_refused(tmp_path):
    write_sqlite(tmp_path / "bag.db3", map(zstd.compress, LARGE))
    assert "bag.db3: has messages of more than 1 MB, which is the most allowed" in refuse(
        read_bag, tmp_path / "bag.db3"
    )


@pytest.mark.usefixtures("small_bound")
def test_chunks_of_mcap_that_unfold_beyond_the_bound_are_refused(tmp_path):
    written = write_mcap(tmp_path / "bag", LARGE, rosbag2.CompressionMode.STORAGE)
    assert (written / "bag.mcap").stat().st_size < 100_000
    assert "bag: unpacks to more than 1 MB, which is the most allowed" in refuse(read_bag, written)


@pytest.mark.usefixtures("small_bound")
@pytest.mark.parametrize("compression", list(rosbag1.Writer.CompressionFormat))
def test_chunks_of_ros_1_that_unfold_beyond_the_bound_are_refused(tmp_path, compression):
    path = write_ros1(tmp_path / "bag.bag", LARGE_OF_ROS1, compression)
    assert path.stat().st_size < 100_000
    assert "bag.bag: unpacks to more than 1 MB, which is the most allowed" in refuse(read_bag, path)


@pytest.mark.usefixtures("small_bound")
def test_parts_that_are_too_large_together_are_refused(tmp_path):
    bag = write_bag(tmp_path / "bag", "a.db3", "b.db3")
    for name in ("a.db3", "b.db3"):
        write_sqlite(bag / name, [encode(1, 700_000)])
    assert "bag: has files of more than 1 MB, which is the most allowed" in refuse(read_bag, bag)


def test_decompressors_of_the_library_are_its_own_again(tmp_path):
    from rosbags.rosbag2 import storage_mcap

    before = dict(storage_mcap.DECOMPRESSORS)
    check_states(write_mcap(tmp_path / "bag", map(encode, SECONDS)))
    assert before == storage_mcap.DECOMPRESSORS


def test_topics_of_one_number_do_not_multiply_messages(tmp_path):
    """As SQLite's join of both tables would: 4e8 rows here."""
    write_sqlite(tmp_path / "bag.db3", [*map(encode, SECONDS), *[b""] * 20_000], topics=[1] * 20_000)
    assert "cannot be read as a ROS bag: " in refuse(read_bag, tmp_path / "bag.db3")


def test_pages_that_refer_to_one_page_many_times_are_refused(tmp_path):
    """A table whose rows a few pages repeat 400^5 times."""
    path, size, fan = tmp_path / "bag.db3", 4096, 400
    with closing(sqlite3.connect(path)) as database:
        database.execute(f"PRAGMA page_size = {size}")
        database.executescript(TABLES)
        database.execute("INSERT INTO topics VALUES (1, '/j', ?)", (JOINT_STATES,))
        rows = [(i, 1, i, bytes(200)) for i in range(100)]
        database.executemany("INSERT INTO messages VALUES (?, ?, ?, ?)", rows)
        database.commit()
        ((root,),) = database.execute("SELECT rootpage FROM sqlite_schema WHERE name = 'messages'")
    content = bytearray(path.read_bytes())
    place, num_pages = (root - 1) * size, len(content) // size
    child = int.from_bytes(content[place + 8 : place + 12], "big")

    def build_page():
        cells = b"".join(struct.pack(">IB", child, i % 128) for i in range(fan))
        first = size - len(cells)
        head = struct.pack(">BHHHBI", 5, 0, fan, first, 0, child)
        pointers = b"".join(struct.pack(">H", first + 5 * i) for i in range(fan))
        return (head + pointers).ljust(first, b"\0") + cells

    for _ in range(4):
        content += build_page()
        num_pages += 1
        child = num_pages
    content[place : place + size] = build_page()
    content[28:32] = struct.pack(">I", num_pages)
    path.write_bytes(content)
    assert "rows, more than a file of its size can contain" in refuse(read_bag, path)


def test_an_index_of_ros_1_that_is_named_repeatedly_is_refused(tmp_path):
    path = write_ros1(tmp_path / "bag.bag", [encode(1, store=Stores.ROS1_NOETIC)] * 50, None)
    content = path.read_bytes()
    place = content.index(b"chunk_count=") + len(b"chunk_count=")
    (start,) = struct.unpack("<Q", content.split(b"index_pos=", 1)[1][:8])
    while start < len(content):  # the last record describes the only chunk
        last, end = start, start
        for _ in range(2):
            end += 4 + int.from_bytes(content[end : end + 4], "little")
        start = end
    path.write_bytes(content[:place] + struct.pack("<L", 101) + content[place + 4 :] + 100 * content[last:])
    assert "bag.bag: has an index that is larger than the file" in refuse(read_bag, path)


def test_queries_of_a_database_end(monkeypatch):
    monkeypatch.setattr(plain_database, "_MOST_STEPS", 1_000_000)
    with closing(sqlite3.connect(":memory:")) as database:
        plain_database.limit_steps(database)
        with pytest.raises(sqlite3.OperationalError, match="interrupted"):
            database.execute("WITH RECURSIVE a(x) AS (SELECT 1 UNION ALL SELECT x FROM a) SELECT count(x) FROM a")
