"""Tasks as files, carrying and holding among them; reasons and advice for tasks that cannot be done."""

from pathlib import Path

from affordance.choice.carry import Carry
from affordance.choice.hammer import Hammer
from affordance.choice.keep import Keep
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
