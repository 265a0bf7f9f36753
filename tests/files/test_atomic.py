"""Files that appear whole or not at all."""

import errno
import json
import os
from enum import Enum
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from helpers.refusals import refuse

from affordance.cli import describe_system_error
from affordance.files.atomic import remove_leftovers, to_plain, write_atomic, write_json, write_text


def test_file_appears_whole_or_not_at_all(tmp_path):
    path = tmp_path / "deep" / "numbers.txt"

    def fail_halfway(temporary):
        temporary.write_text("half", encoding="utf-8")
        raise RuntimeError("killed")

    with pytest.raises(RuntimeError, match="killed"):
        write_atomic(path, fail_halfway)
    assert list(path.parent.iterdir()) == []
    write_text(path, "whole")
    with pytest.raises(RuntimeError, match="killed"):
        write_atomic(path, fail_halfway)
    assert path.read_text(encoding="utf-8") == "whole"


def test_leftovers_of_a_killed_run_are_removed(tmp_path):
    def leave(temporary):
        temporary.write_text("half", encoding="utf-8")
        os.link(temporary, temporary.with_name(temporary.name + "x"))  # survives the clean-up of write_atomic
        raise RuntimeError

    with pytest.raises(RuntimeError):
        write_atomic(tmp_path / "a" / "numbers.txt", leave)
    write_text(tmp_path / "a" / "whole.txt", "whole")
    remove_leftovers(tmp_path)
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == ["whole.txt"]


class Colour(Enum):
    RED = "red"


class Pair(NamedTuple):
    a: float
    b: tuple


def test_configurations_become_plain_json(tmp_path):
    content = {"pair": Pair(1.5, (np.float64(0.1), np.array([1, 2]))), "colour": Colour.RED, "path": Path("a/b.yaml")}
    assert to_plain(content) == {"pair": {"a": 1.5, "b": [0.1, [1, 2]]}, "colour": "red", "path": "b.yaml"}
    write_json(tmp_path / "x.json", content)
    assert json.loads((tmp_path / "x.json").read_text(encoding="utf-8"))["pair"]["b"] == [0.1, [1, 2]]
    assert "not JSON compliant" in refuse(write_json, tmp_path / "y.json", {"bad": np.nan}, error=ValueError)
    assert not (tmp_path / "y.json").exists()


@pytest.mark.parametrize(
    "error",
    [
        OSError(errno.ENOSPC, "No space left on device"),
        OSError("not enough free space"),
        PermissionError(13, "denied"),
    ],
)
def test_error_of_the_system_names_the_file_and_not_the_temporary_one(tmp_path, error):
    def fail(temporary):
        raise error

    with pytest.raises(OSError, match=f"{error.strerror or error}") as caught:
        write_atomic(tmp_path / "numbers.txt", fail)
    assert caught.value.filename == str(tmp_path / "numbers.txt")
    assert caught.value.errno == error.errno
    assert describe_system_error(caught.value) == f"{tmp_path / 'numbers.txt'}: {error.strerror or error}"


def test_temporary_file_that_cannot_be_made_is_named_as_the_file(tmp_path):
    def fail(temporary):
        (temporary / "below a file that is not there").open("w", encoding="utf-8")

    def fail_itself(temporary):
        raise PermissionError(errno.EACCES, "Permission denied", str(temporary))

    with pytest.raises(FileNotFoundError) as caught:
        write_atomic(tmp_path / "numbers.txt", fail)
    assert caught.value.filename.endswith("not there")  # another file, which is named as it is
    with pytest.raises(PermissionError) as refused:
        write_atomic(tmp_path / "numbers.txt", fail_itself)
    assert refused.value.filename == str(tmp_path / "numbers.txt")


def test_errors_without_a_file_are_described_without_one():
    assert describe_system_error(OSError(errno.ENOSPC, "No space left on device")) == "No space left on device"
    assert describe_system_error(OSError("odd\nthing")) == "odd thing"
    assert describe_system_error(OSError()) == "OSError"
