"""Checks of arguments: right ones are returned in the form that is needed, wrong ones are named with the bound."""

from pathlib import Path

import numpy as np
import pytest

from affordance.arguments import (
    check_array,
    check_colour,
    check_fractions,
    check_kind,
    check_number,
    check_pose,
    check_seed,
)
from affordance.exceptions import AffordanceError, BadArgumentError
from affordance.files.constraints import check_path


def turn(angle):
    X = np.eye(4)
    X[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return X


def mirror(axis):
    X = np.eye(4)
    X[axis, axis] = -1.0
    return X


def test_what_is_right_is_returned_as_it_is_wanted(tmp_path):
    assert check_path("path", str(tmp_path)) == check_path("path", tmp_path) == tmp_path
    assert check_seed(3) == check_seed((3,)) == check_seed([np.int64(3)]) == (3,)
    assert check_seed((0, 7)) == (0, 7)
    assert check_number("x", np.float32(0.5), 0.0, 1.0) == 0.5
    assert check_colour("colour", [0, 0.5, 1]) == (0.0, 0.5, 1.0)
    np.testing.assert_array_equal(check_fractions("fractions", [0, 0.5, 1]), [0.0, 0.5, 1.0])


def test_poses_are_kept_as_read_only_copies():
    X = turn(0.3)
    kept = check_pose("X", X)
    X[0, 3] = 1.0
    assert kept[0, 3] == 0.0
    assert not kept.flags.writeable


@pytest.mark.parametrize(
    ("check", "message"),
    [
        (lambda: check_seed(-1), "seed: is -1, must be from 0 to 4294967295"),
        (lambda: check_seed((0, 2**33)), r"seed\[1\]: is 8589934592, must be from 0 to 4294967295"),
        (lambda: check_seed(1.5), "seed: is 1.5, must be a whole number"),
        (lambda: check_seed(True), "seed: is True, must be a number"),
        (lambda: check_seed(()), "seed: is empty, must be a whole number"),
        (lambda: check_path("path", 3), "path: is 3, must be a path, as text or pathlib.Path"),
        (lambda: check_path("path", ""), "path: is '', must be a path"),
        (lambda: check_number("mass", float("nan"), 0.0, 1.0, "kg"), "mass: is nan, must be from 0 to 1 kg"),
        (lambda: check_number("mass", "1"), "mass: is '1', must be a number"),
        (lambda: check_fractions("fractions", [25]), r"fractions\[0\]: is 25, must be from 0 to 1; 25 % is 0.25"),
        (lambda: check_fractions("fractions", [-0.1]), r"fractions\[0\]: is -0.1, must be from 0 to 1"),
        (lambda: check_colour("colour", (212, 160, 23)), r"colour\[0\]: is 212, .* 0 to 1; 212 of 255 is 0.831"),
        (lambda: check_colour("colour", "brass"), "colour: is 'brass', must be red, green and blue"),
        (lambda: check_colour("colour", (0.1, 0.2)), r"colour: has the shape \(2,\), must have \(3,\)"),
        (lambda: check_array("q", [1.0, np.inf], (None,)), r"q\[1\]: is inf, must be finite"),
        (lambda: check_array("q", [[1.0], [1.0, 2.0]], (None, 2)), r"q: is .*, must be numbers of shape \(n, 2\)"),
        (lambda: check_kind("tool", 3, str, "text"), "tool: is of type int, must be of type str; text"),
        (lambda: check_pose("X", 2.0 * np.eye(4)), r"X: has the last row \[0.0, 0.0, 0.0, 2.0\]"),
        (lambda: check_pose("X", np.diag([2.0, 1.0, 1.0, 1.0])), "X: has axes of the lengths 2, 1, 1, must be a rot"),
        (lambda: check_pose("X", mirror(1)), "X: is a reflection, must be a rotation"),
        (lambda: check_pose("X", np.eye(3)), r"X: has the shape \(3, 3\), must have \(4, 4\)"),
    ],
)
def test_what_is_wrong_is_named_with_its_bound(check, message):
    with pytest.raises(BadArgumentError, match=f"^{message}") as caught:
        check()
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, AffordanceError)
    assert isinstance(caught.value, ValueError)


def test_path_like_objects_are_paths():
    class Folder:
        def __fspath__(self):
            return "somewhere"

    assert check_path("path", Folder()) == Path("somewhere")
