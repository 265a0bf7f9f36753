"""Files of models, corrupted in hundreds of ways.

Each case takes one file of a valid folder of models and makes it invalid: a key is removed, doubled or misspelt; a
value has another type, is far out of bounds, or is not a number; a list has another length; the text is truncated,
empty, or not text at all. The command line must answer with status 2 and one line that names file and key, and must
write nothing.
"""

import contextlib
import copy
import io
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

import yaml
from hypothesis import strategies as st

from affordance.cli import main
from affordance.experiments import hammer, reach
from affordance.experiments.shared import blows, suite
from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.suite import find_experiment
from affordance.extensions.pixels.experiments import vision
from affordance.files.model_folder import MODELS
from affordance.plant.load import load_arm
from affordance.proprioception.faults import Faults

# Files to corrupt, each with the experiment that reads it first.
FILES = {
    "materials.yaml": "weight",
    "tools/weight.yaml": "weight",
    "tools/com.yaml": "com",
    "tools/novel.yaml": "reach",
    "tools/uncommon.yaml": "vision",
    "paths/reach.yaml": "reach",
    "paths/mash.yaml": "vision",
    "nail.yaml": "hammer",
    "faults.yaml": "weight",
}
# Files whose keys are free names, and keys that are optional in every file.
NAMED = frozenset({"materials.yaml", "faults.yaml"})
OPTIONAL = frozenset({"position", "rpy_deg", "looks_like", *(field.name for field in fields(Faults))})
# Keys that are optional in one file only. Joints that a start does not name keep the home posture.
_START = frozenset({"start", *load_arm().joint_names})
OPTIONAL_IN = {
    "materials.yaml": frozenset({"source"}),
    "tools/uncommon.yaml": frozenset({"grips"}),
    "paths/reach.yaml": _START,
    "paths/mash.yaml": _START,
    "nail.yaml": _START,
}
# Replacements for a number, a text, a list and a mapping: values of a wrong type or far out of bounds.
WRONG: dict[type, tuple[Any, ...]] = {
    float: (None, True, "heavy", [], {}, [1.0], float("nan"), float("inf"), -1e30, 1e30, 10**400),
    str: (None, False, 3, 2.5, "", "  ", [], {}, ["steel"]),
    list: (None, True, 7, "many", {}, []),
    dict: (None, True, 7, "all", [], [1.0]),
}
ARM = (
    ("arm.sdf", "<mass>", "<mass>-"),
    ("arm.sdf", "<mass>", "<mass>nan "),
    ("arm.sdf", "<ixx>", "<ixx>-"),
    ("arm.sdf", "<ixx>", "<ixx>1e300 "),
    ("arm.sdf", "</link>", ""),
    ("arm.sdf", "<link", "<lonk"),
    ("arm.sdf", 'type="revolute"', 'type="ball"'),
    ("arm.sdf", "<sdf", "sdf"),
    ("arm.sdf", "hand_grip", "hand_grasp"),
    ("arm.dmd.yaml", "directives", "directions"),
    ("arm.dmd.yaml", "add_weld", "add_wild"),
    ("arm.dmd.yaml", "models/arm.sdf", "models/leg.sdf"),
    ("arm.dmd.yaml", "[0, 0, 1.44]", "[0, 0]"),
    ("arm.dmd.yaml", "[-0.349066]", "[-9.0]"),
    ("arm.dmd.yaml", "[-0.349066]", "[-0.3, 1.0]"),
    ("arm.dmd.yaml", "shoulder_rotation", "knee_rotation"),
    ("arm.dmd.yaml", "arm::base", "arm::bottom"),
    ("package.xml", "<name>", "<nom>"),
)


# If one of these files is corrupted, the message may name any of them, because they load each other.
ARM_FILES = re.compile(r"arm\.sdf|arm\.dmd\.yaml|package\.xml")


class Answer(NamedTuple):
    """Answer of the command line: its exit status, its output, and whether it wrote files."""

    status: int
    out: str
    err: str
    written: bool

    @property
    def refused(self) -> bool:
        """True if it is a correct refusal: status 2, one line, nothing written."""
        return self.status == 2 and not self.out and self.err.count("\n") == 1 and not self.written


@dataclass(frozen=True)
class Case:
    """One file of the models, with its content corrupted."""

    file: str  # path in the folder of models
    content: bytes  # corrupted content
    what: str  # description of the corruption
    # Keys, one of which the refusal must name in addition to the file; empty if there is no key to name.
    keys: tuple[str, ...] = ()


@contextlib.contextmanager
def copy_models() -> Iterator[Path]:
    """Yields a copy of the models that can be corrupted."""
    with tempfile.TemporaryDirectory() as folder:
        yield Path(shutil.copytree(MODELS, Path(folder) / "models"))


def answer(models: Path, case: Case) -> Answer:
    """Asks the command line, in this process, to run an experiment with one corrupted file; nothing is simulated."""
    path, out = models / case.file, models.parent / "out"
    good = path.read_bytes()
    path.write_bytes(case.content)
    arguments = ["--robot", str(models), "--out", str(out), "--fault", "bias", "--jobs", "1"]
    printed, complained = io.StringIO(), io.StringIO()
    try:
        with (
            mock.patch.object(suite, "find_experiment", _find_without_observers),
            mock.patch.object(suite, "write_results", _do_nothing),
            contextlib.redirect_stdout(printed),
            contextlib.redirect_stderr(complained),
        ):
            status = main(["run", FILES[case.file], *arguments])
    finally:
        path.write_bytes(good)
    found = Answer(status, printed.getvalue(), complained.getvalue(), out.exists())
    shutil.rmtree(out, ignore_errors=True)
    return found


def names_the_place(case: Case, found: Answer) -> bool:
    """Returns True if a refusal names the file, and after it one of the case's keys as part of the path."""
    _, name, rest = found.err.partition(f"{Path(case.file).name}: ")
    path, *more = rest.split(": ")
    if path == "tools" and more:  # the key of one tool, by its name, or of all of them
        path += f": {more[0]}"
    return bool(name) and (
        not case.keys or any(re.search(rf"(?<!\w){re.escape(key)}(?!\w)", path) for key in case.keys)
    )


@st.composite
def spoil(draw: st.DrawFn) -> Case:
    """Corrupts one place in one file of the models."""
    file = draw(st.sampled_from(sorted(FILES)))
    text = (MODELS / file).read_text(encoding="utf-8")
    content = yaml.safe_load(text)
    places = {way: list(_list_places(content, way, file)) for way in ("value", "drop", "add", "length")}
    way = draw(st.sampled_from(["text", *(way for way, found in places.items() if found)]))
    if way == "text":
        return _spoil_text(draw, file, text)
    place = draw(st.sampled_from(places[way]))
    key = next((str(part) for part in reversed(place) if isinstance(part, str)), "")
    root = {"": copy.deepcopy(content)}
    holder: Any = root
    for part in place[:-1]:
        holder = holder[part]
    old = holder[place[-1]]
    if way == "drop":
        del holder[place[-1]]
        what = f"without {place}"
    elif way == "add":
        name = draw(st.text("abcdefghijklmnopqrstuvwxyz_", min_size=3, max_size=12).map(lambda word: f"x_{word}"))
        # Where top-level names are free, only the keys below them can be unknown.
        old[name] = draw(st.sampled_from((1.0, "x", None)))
        key, what = name, f"{name!r} added to {place}"
    elif way == "length":
        number = draw(st.sampled_from((0, 1, 2, 4, 5)))
        holder[place[-1]] = [0.05] * number
        what = f"{number} numbers at {place}"
    else:
        kind = float if isinstance(old, int | float) else type(old)
        holder[place[-1]] = draw(st.sampled_from(WRONG[kind]))
        what = f"{holder[place[-1]]!r:.40} at {place}"
    return Case(file, yaml.safe_dump(root[""]).encode(), what, (key,) if key else ())


def _spoil_text(draw: st.DrawFn, file: str, text: str) -> Case:
    garbage = {
        "empty": b"",
        "binary": draw(st.binary(min_size=1, max_size=50)).replace(b"\n", b" ") + b"\xff\xfe\x00",
        "a list": b"- 1\n- 2\n",
        "a number": b"42\n",
        "open bracket": text.encode() + b"\nmore: [1, 2\n",
        "tab": text.encode() + b"\n\tmore: 1\n",
        "object": b"tools: !!python/object/apply:os.getcwd []\n",
        "two documents": text.encode() + b"\n---\n" + text.encode(),
        "unknown alias": b"tools: *nothing\n",
        "deep": b"[" * 5000,
        "key twice": text.encode() + b"\n" + text[text.index("\n" + next(iter(yaml.safe_load(text)))) + 1 :].encode(),
    }
    name = draw(st.sampled_from(sorted(garbage)))
    return Case(file, garbage[name], name)


def _list_places(content: Any, way: str, file: str) -> Iterator[tuple[Any, ...]]:
    """Lists the places in a parsed file to which a way of corruption applies; each begins with "", the whole file."""
    if way == "add":
        yield ("",)
    optional = OPTIONAL | OPTIONAL_IN.get(file, frozenset())
    yield from _list_inner_places(content, way, ("",), optional, are_names=file in NAMED)


def _list_inner_places(
    content: Any, way: str, at: tuple[Any, ...], optional: frozenset[str], *, are_names: bool
) -> Iterator[tuple[Any, ...]]:
    for key, value in content.items() if isinstance(content, dict) else enumerate(content):
        place = (*at, key)
        required = isinstance(key, str) and not are_names and key not in optional
        is_vector = isinstance(value, list) and value and isinstance(value[0], int | float)
        applies = {
            "value": True,
            "drop": required,
            "add": isinstance(value, dict),
            "length": is_vector,
        }
        if applies[way]:
            yield place
        if isinstance(value, dict | list):
            yield from _list_inner_places(value, way, place, optional, are_names=key == "grips")


def _find_without_observers(name: str) -> Any:
    """Returns an experiment that plans its task, and so may refuse a file, but simulates no observer."""
    plans: dict[str, Callable[[Setup], object]] = {
        "reach": lambda setup: reach.plan(setup, *reach.read(setup)[1:]),
        "hammer": lambda setup: blows.plan_blows(setup, *hammer.read(setup)[1:], setup.models / hammer.NAIL),
        "vision": lambda setup: vision.check_mashing(setup, *vision.read(setup)),
    }
    run: Any = plans.get(name, _do_nothing)
    return find_experiment(name)._replace(run=run)


def _do_nothing(*_: Any) -> None:
    """Takes the place of whatever would run once the input is accepted."""
