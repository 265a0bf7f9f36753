"""Tasks as files, carrying and holding among them; what cannot be done says why, and what could be."""

from pathlib import Path

import pytest
from helpers.two_tools import STICK

from affordance.belief.material_memory import MaterialMemory
from affordance.choice.carry import Carry
from affordance.choice.hammer import Hammer
from affordance.choice.keep import Keep
from affordance.choice.options import Option
from affordance.choice.reach import Reach
from affordance.choice.tasks import list_tasks, load_task, load_task_file
from affordance.choice.tool_options import list_drawn_options
from affordance.control.timed_path import TimedPath, load_path
from affordance.exceptions import BadValueError
from affordance.files.model_folder import MODELS
from affordance.objects.tool import list_densities
from affordance.settings import Settings

SETTINGS = Settings()
HELD = STICK.gripped_by(STICK.grips[0])
KNOWN = MaterialMemory.from_densities(list_densities([STICK]))
START = load_path(MODELS / "paths" / "reach.yaml").start
FAR = TimedPath(points=((0.5, 0.0, 0.3),), duration=1.0, tolerance=0.02, start=START)


def list_one() -> list[Option]:
    return list_drawn_options([STICK])[:1]


def test_all_tasks_of_our_models_load() -> None:
    kinds = {name: type(load_task(MODELS, name)) for name in list_tasks(MODELS)}
    assert kinds == {"hammer": Hammer, "reach": Reach, "mash": Reach, "carry": Carry, "hold": Keep}


def test_file_says_of_which_kind_it_is(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    for name, file in (("reach", "paths/reach.yaml"), ("hammer", "nail.yaml"), ("mash", "paths/mash.yaml")):
        path.write_text(f"kind: {name}\n" + (MODELS / file).read_text(encoding="utf-8"), encoding="utf-8")
        assert load_task_file(path) == load_task(MODELS, name)
    assert load_task_file(MODELS / "tasks" / "hold.yaml") == Keep(5.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("duration: 3", "mine.yaml: kind: is missing, must be one of hammer, reach, mash, carry, hold"),
        (
            "kind: cary",
            "mine.yaml: kind: is 'cary', must be one of hammer, reach, mash, carry, hold; did you mean 'ca",
        ),
        ("kind: [1]", r"mine.yaml: kind: is \[1\], must be one of"),
        ("kind: hold\nduration: -1", "mine.yaml: duration: is -1, must be from 0.05 to 3600"),
        ("kind: hold\nduration: 3\nposture: {elbow: 9}", "mine.yaml: posture.elbow: is 9, must be from"),
        ("kind: carry\nduration: 3\ntolerance: 0.1\npoints: []", "mine.yaml: points: is"),
        (
            "kind: carry\nduration: 3\ntolerance: 0.1\ntilt: 2\npoints: [[0, 0, 1]]",
            "tilt: is 2, must be from 0.001 to",
        ),
        ("- 3", "mine.yaml: "),
    ],
)
def test_bad_file_is_refused_in_one_line(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(BadValueError, match=message) as caught:
        load_task_file(path)
    assert "\n" not in str(caught.value)
