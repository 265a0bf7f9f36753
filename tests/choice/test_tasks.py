"""Tasks as files, carrying and holding among them; reasons and advice for tasks that cannot be done."""

from pathlib import Path

import pytest
from helpers.refusals import refuse

from affordance.choice.carry import Carry, Keep
from affordance.choice.hammer import Hammer
from affordance.choice.reach import Reach
from affordance.choice.tasks import list_tasks, load_task, load_task_file
from affordance.files.model_folder import MODELS


def test_all_tasks_of_our_models_load() -> None:
    kinds = {name: type(load_task(MODELS, name)) for name in list_tasks(MODELS)}
    assert kinds == {"hammer": Hammer, "reach": Reach, "mash": Reach, "carry": Carry, "hold": Keep}


def test_file_says_of_which_kind_it_is(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    for name, file in (("reach", "paths/reach.yaml"), ("hammer", "nail.yaml"), ("mash", "paths/mash.yaml")):
        path.write_text(f"kind: {name}\n" + (MODELS / file).read_text(encoding="utf-8"), encoding="utf-8")
        assert load_task_file(path) == load_task(MODELS, name)
    assert load_task_file(MODELS / "tasks" / "hold.yaml") == Keep(5.0)


CARRY = "kind: carry\nduration: 3\ntolerance: 0.1\n"
KINDS = "hammer, reach, mash, carry, hold"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("duration: 3", f"mine.yaml: kind: is missing, must be one of {KINDS}"),
        ("kind: cary", f"mine.yaml: kind: is 'cary', must be one of {KINDS}; did you mean 'carry'?"),
        ("kind: [1]", f"mine.yaml: kind: is [1], must be one of {KINDS}"),
        ("kind: hold\nduration: -1", "mine.yaml: duration: is -1, must be from 0.05 to 3600"),
        ("kind: hold\nduration: 3\nposture: {elbow: 9}", "mine.yaml: posture.elbow: is 9, must be from"),
        (f"{CARRY}points: []", "mine.yaml: points: is [], must be a list with at least one entry"),
        (f"{CARRY}tilt: 2\npoints: [[0, 0, 1]]", "tilt: is 2, must be from 0.001 to"),
        ("- 3", "mine.yaml: is a list, must be a mapping of keys to values"),
    ],
)
def test_mistake_in_a_task_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    assert said in refuse(load_task_file, path)
