"""The table of bad values (``tests/system/bad_values/``): its rows, and the readers that must refuse them."""

import atexit
import contextlib
import copy
import functools
import re
import shlex
import shutil
import sqlite3
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import yaml

from affordance import exceptions
from affordance.belief.memory_file import parse_memory
from affordance.choice.hammer import load_hammer
from affordance.choice.tasks import load_task_file
from affordance.commands.new_protocol import write_protocol
from affordance.control.timed_path import load_path
from affordance.experiments.protocol_runs import load_choice_experiment, load_protocol_experiment
from affordance.experiments.suite import load_experiment
from affordance.files.data_model import load_model
from affordance.files.model_folder import MODELS
from affordance.identification.evidence.gains import read_gains
from affordance.identification.payload_formats import read_payload
from affordance.identification.recording.run_file import read_run
from affordance.memory.ledger import open_memory
from affordance.memory.stored_trials import parse_trial
from affordance.named_settings import change_settings, parse_changes
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.plant.load import load_arm
from affordance.proprioception.faults import load_faults
from affordance.protocols.object_entries import build_objects
from affordance.protocols.people_tables import load_people_lifts, load_published
from affordance.protocols.protocol import load_protocol
from affordance.reporting.section import load_claims, render_section
from affordance.robots.importer import ImportOptions, extract_arm
from affordance.robots.kept import import_arm
from affordance.robots.recorded_arm import load_robot
from affordance.settings import DEFAULT_SETTINGS
from helpers.answers import answer
from helpers.generated_runs import write_urdf as write_recorded_robot
from helpers.invented_model import Outer
from helpers.meshes import join, make_box, write_obj
from helpers.robot_files import MJCF, SDF, build_urdf, write_urdf
from helpers.trials import STEEL, WOOD, hold, hold_workshop

TABLES = Path(__file__).parents[1] / "system" / "bad_values"
_HAMMER = (make_box([0, -10, -10], [200, 10, 10]), make_box([200, -50, -20], [240, 50, 20]))  # mm


class Row(NamedTuple):
    """One bad value."""

    group: dict[str, Any]  # entries that the rows of a group share
    change: list[Any]  # change that makes a good value bad
    message: str  # part of the answer, in which ``…`` stands for any text; ``^`` and ``$`` are its ends


def list_rows() -> list[Any]:
    """Returns all rows as parameters of a test, named by table, group and number."""
    tables = {path.stem: yaml.safe_load(path.read_text(encoding="utf-8")) for path in sorted(TABLES.glob("*.yaml"))}
    return [
        pytest.param(Row(group, change, message), id=f"{table}-{name}-{number}")
        for table, groups in tables.items()
        for name, group in groups.items()
        for number, (*change, message) in enumerate(group["rows"])
    ]


def is_said(message: str, answer: str) -> bool:
    """Returns True if an answer holds a message of the table."""
    starts, ends = message.startswith("^"), message.endswith("$")
    inner = message[starts : len(message) - ends]
    pattern = ".*".join(re.escape(part) for part in inner.split("…"))
    return re.search(f"{'^' * starts}{pattern}{'$' * ends}", answer) is not None


def refuse(row: Row) -> str:
    """Gives a bad value, in the present folder, to what must refuse it in one line; returns what that says."""
    group, change = row.group, row.change
    if group.get("file", "").startswith("models/"):
        shutil.copytree(MODELS, "models")
    for make in group.get("make", ()):
        MAKERS[make]()
    for name, text in group.get("files", {}).items():
        _write(name, text)
    if "file" in group:
        text = spoil(_get_good(group), change, everywhere=group.get("everywhere", False))
        change = [_write(group["file"], text)]
    if group["read"] == "command":
        answer = run_command(group.get("words", "") + " " + (change[0] if "file" not in group else ""))
    else:
        with pytest.raises(getattr(exceptions, group.get("error", "BadValueError"))) as caught:
            READERS[group["read"]](*change, **group.get("with", {}))
        answer = str(caught.value)
    assert "\n" not in answer
    return answer


def _get_good(group: dict[str, Any]) -> str | None:
    if "of" in group:
        return (MODELS / group["of"]).read_text(encoding="utf-8")
    return BASES[group["base"]]() if "base" in group else group.get("good")


def spoil(good: str | None, change: Sequence[Any], *, everywhere: bool = False) -> str:
    """Returns a good text with a change, of the first place of a text or of every one.

    The change is the whole text, if there is no good one; texts, each followed by what replaces it; or a mapping of
    keys of the good text, read as YAML, to values.
    """
    if good is None:
        (text,) = change
        return text
    if isinstance(change[0], dict):
        return yaml.safe_dump(put(yaml.safe_load(good), change[0]), sort_keys=False, allow_unicode=True)
    for old, new in zip(change[::2], change[1::2], strict=True):
        assert old in good, old
        good = good.replace(old, new, -1 if everywhere else 1)
    return good


def put(content: Any, values: dict[str, Any]) -> Any:
    """Returns a content in which keys such as ``parts.0.colour`` have other values."""
    content = copy.deepcopy(content)
    for place, value in values.items():
        *way, last = (int(key) if key.isdigit() else key for key in place.split("."))
        holder = content
        for key in way:
            holder = holder[key]
        holder[last] = value
    return content


def run_command(words: str) -> str:
    """Runs the command line, which must end with status 2 and write nothing; returns what it says."""
    before = list_content()
    answered = answer(*shlex.split(words), status=2)
    assert not answered.out
    assert list_content() == before
    return answered.err.removesuffix("\n")


def list_content() -> dict[Path, bytes | None]:
    """Returns the files and folders of the present folder, models left out, with their content."""
    return {
        path: path.read_bytes() if path.is_file() else None
        for path in sorted(Path().rglob("*"))
        if path.parts[0] != "models"
    }


def _write(name: str, text: str) -> Path:
    path = Path(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8", newline="")
    return path


def _plan_for_stick(path: Path, name: str) -> None:
    """Plans for the first tool alone, which is enough to find that a task cannot be done."""
    loaded = load_choice_experiment(name, Path("models"))
    replace(loaded, novel=loaded.novel[:1]).plan(jobs=1)


def _render(path: Path, numbers: dict[str, Any]) -> None:
    render_section(path, numbers, numbers)


def _read_trial(values: dict[str, Any]) -> None:
    trial = hold("hammer", (WOOD, STEEL), (650.0, 7700.0), 5, num_errors=3)
    parse_trial(Path("memory.jsonl"), "line 3", put(trial.to_dict(), values))


def _read_protocol(path: Path) -> None:
    build_objects(load_protocol(path).objects, path, MODELS)


def _read_people(path: Path) -> None:
    protocol = load_protocol(Path("mine.yaml"))
    load_people_lifts(path, build_objects(protocol.objects, Path("mine.yaml"), MODELS), protocol.blocks)


def _read_tools(path: Path, materials: str = "materials.yaml") -> None:
    load_tools(path, load_materials(Path(materials)))


def _read_recorded_robot(change: Sequence[str] | None, tip: str, base: str | None) -> None:
    path = write_recorded_robot(Path())
    if change is not None:
        path.write_text(path.read_text().replace(*change))
    load_robot(path, tip, base)


def _extract_arm(path: Path, **options: Any) -> None:
    extract_arm(path, ImportOptions(**options))


def _write_recording(header: str = "time,q_1,q_2,tau_1,tau_2") -> None:
    rows = (f"{0.01 * k:g},{0.001 * k:g},0.3,5,{-0.03 * k:g}" for k in range(40))
    _write("run.csv", "\n".join(([header] if header else []) + [*rows, ""]))


def _write_people_protocol() -> None:
    _, schema = write_protocol("mine", Path())
    schema.unlink()


def _write_notes() -> None:
    with contextlib.closing(sqlite3.connect("notes.sqlite")) as database:
        database.execute("CREATE TABLE notes (x INT)")


def _write_workshop() -> None:
    with open_memory(Path("workshop.sqlite")) as ledger:
        ledger.append(hold_workshop(9))


def _copy(*names: str) -> None:
    for name in names:
        shutil.copy(MODELS / name, Path(name).name)


def _copy_demo() -> None:
    _copy(
        "arm.dmd.yaml",
        "arm.sdf",
        "package.xml",
        "tools/novel.yaml",
        *(f"demo/{path.name}" for path in (MODELS / "demo").iterdir()),
    )


@functools.cache
def _import_two_arms() -> Path:
    """Returns the folder of an arm of four joints, imported from its URDF once."""
    root = Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, root)
    import_arm(write_urdf(root), ImportOptions("right_tool"), root / "two_arms", with_meshes=False, fits_tasks=False)
    return root / "two_arms"


BASES: dict[str, Callable[[], str]] = {"urdf": build_urdf, "sdf": lambda: SDF, "mjcf": lambda: MJCF}
READERS: dict[str, Callable[..., object]] = {
    "arm": lambda path: load_arm(Path("arm.dmd.yaml")),
    "choice": lambda path, name: load_choice_experiment(name, Path("models")),
    "claims": load_claims,
    "experiment": lambda path, name: load_experiment(name, Path("models")),
    "faults": lambda path: load_faults(path, ["a", "b"], load_arm().joint_names),
    "gains": read_gains,
    "invented": lambda path: load_model(path, Outer),
    "import": lambda options: _extract_arm(_write("two_arms.urdf", build_urdf()), **options),
    "materials": load_materials,
    "memory": parse_memory,
    "nail": load_hammer,
    "path": load_path,
    "payload": lambda name, text: read_payload(_write(name, text)),
    "people": _read_people,
    "plan": _plan_for_stick,
    "protocol": _read_protocol,
    "published": load_published,
    "recorded robot": _read_recorded_robot,
    "rehearsal": lambda path: load_protocol_experiment(str(path)),
    "robot": _extract_arm,
    "run": lambda path: read_run(Path("run.csv")),
    "section": _render,
    "settings": lambda word: change_settings(DEFAULT_SETTINGS, parse_changes([word])),
    "table": lambda header: (_write_recording(header), read_run(Path("run.csv"))),
    "task": load_task_file,
    "tools": _read_tools,
    "trial": _read_trial,
}
MAKERS: dict[str, Callable[[], object]] = {
    "arm": lambda: _copy("arm.dmd.yaml", "package.xml"),
    "demo": _copy_demo,
    "hammer.obj": lambda: write_obj(Path("hammer.obj"), *join(*_HAMMER)),
    "mine.yaml": _write_people_protocol,
    "notes.sqlite": _write_notes,
    "run.csv": _write_recording,
    "two_arms": lambda: shutil.copytree(_import_two_arms(), "two_arms"),
    "two_arms.urdf": lambda: write_urdf(Path()),
    "workshop.sqlite": _write_workshop,
}
