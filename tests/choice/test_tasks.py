"""Tasks as files, carrying and holding among them; what cannot be done says why, and what could be."""

from pathlib import Path

import numpy as np
import pytest
from helpers.two_tools import STICK
from scipy.spatial.transform import Rotation

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.carry import Carry
from affordance.choice.demand import Criterion
from affordance.choice.hammer import Hammer
from affordance.choice.keep import Keep
from affordance.choice.options import Option
from affordance.choice.reach import Reach
from affordance.choice.tasks import list_tasks, load_task, load_task_file
from affordance.choice.tool_options import list_drawn_options
from affordance.choice.weighing import GripBounds, weigh
from affordance.control.timed_path import TimedPath, load_path
from affordance.exceptions import AffordanceError, BadValueError
from affordance.files.model_folder import MODELS
from affordance.objects.tool import list_densities
from affordance.plant.arm import Arm
from affordance.plant.arm_model import ArmModel
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


def measure_carrying(arm: Arm, q: Array) -> tuple[Array, Array]:
    """Positions of the hand, and its angles from the first orientation, by Drake."""
    model, places, turns = ArmModel(arm), [], []
    for row in q:
        model.set_posture(row)
        X_WH = model.compute_hand_pose()
        places.append(X_WH.translation())
        turns.append(X_WH.rotation().matrix())
    angles = [Rotation.from_matrix(turn @ turns[0].T).magnitude() for turn in turns]
    return np.array(places), np.array(angles)


def test_what_is_carried_stays_level_on_its_path(arm: Arm) -> None:
    task = load_task(MODELS, "carry")
    assert isinstance(task, Carry)
    cost = task.build_cost(ArmModel(arm), HELD.components, SETTINGS)
    assert cost.infeasible_reason == ""
    places, angles = measure_carrying(arm, cost.motion.q[::20])
    times = cost.motion.control_period * np.arange(len(cost.motion.q))[::20]
    trajectory = task.path.build_trajectory()
    asked = np.array([trajectory.value(time)[:, 0] for time in times])
    assert np.linalg.norm(places - places[0] - asked, axis=1).max() < task.path.tolerance
    assert angles.max() < task.tilt
    assert np.linalg.norm(places[-1] - places[0]) > 0.3


def test_hold_bears_the_static_torque_of_the_posture(arm: Arm) -> None:
    bent = Keep(4.0, (("elbow_flexion", 1.2),))
    cost = bent.build_cost(ArmModel(arm), HELD.components, SETTINGS)
    pi = HELD.parameters[None]
    model = ArmModel(arm)
    model.set_payload(HELD.parameters)
    model.set_posture(arm.find_posture({"elbow_flexion": 1.2}))
    tau = model.compute_inverse_dynamics(np.zeros(arm.num_joints))
    found, demand = cost.compute(pi), cost.compute_demand(pi)
    assert found.work == 0.0
    assert found.effort == pytest.approx(4.0 * tau @ tau)
    np.testing.assert_allclose(demand.loads[:, 0], np.abs(tau) / arm.limits.tau_max, rtol=1e-9, atol=1e-12)
    gravity = 9.81
    assert demand.force == pytest.approx(HELD.mass * gravity, rel=1e-3)


def test_posture_that_the_arm_cannot_take_names_joint_and_bound(arm: Arm) -> None:
    with pytest.raises(AffordanceError, match="puts elbow_flexion at 6 rad, must be from"):
        Keep(4.0, (("elbow_flexion", 6.0),)).build_cost(ArmModel(arm), HELD.components, SETTINGS)


@pytest.mark.parametrize("task", [Reach(FAR), Carry(FAR)])
def test_path_beyond_reach_says_where_by_how_much_and_what_could_be_done(task: Reach | Carry) -> None:
    advice = weigh(list_one(), task, KNOWN, SETTINGS, num_samples=50, rng=np.random.default_rng(0))
    with pytest.raises(AffordanceError) as caught:
        _ = advice.best
    said = str(caught.value)
    assert "leaves the path by 0." in said
    assert " m, must stay within 0.02 m: near point " in said
    assert ", where " in said
    assert said.endswith(" it could")
    assert "; 0." in said or "; mirrored" in said or "times slower" in said


def test_tool_that_is_too_heavy_could_be_lighter() -> None:
    held = {"options": list_one(), "task": Keep(1.0), "memory": KNOWN, "settings": SETTINGS}
    weight = weigh(**held, criterion=Criterion.GRIP, num_samples=50, rng=np.random.default_rng(0)).best.force.mean
    bounds = GripBounds(force=0.5 * weight)
    advice = weigh(**held, bounds=bounds, num_samples=50, rng=np.random.default_rng(0))
    with pytest.raises(AffordanceError, match=r"with 0\.(49|48|47|46) times its weight it could$"):
        _ = advice.best


def test_motion_is_planned_once_in_a_process(monkeypatch: pytest.MonkeyPatch) -> None:
    planned = []
    plan = Carry.build_cost

    def count(task: Carry, *arguments: object) -> object:
        planned.append(task)
        return plan(task, *arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(Carry, "build_cost", count)
    task = Carry(TimedPath(points=((0.0, 0.01, 0.0),), duration=0.1, tolerance=0.02))
    for _ in range(2):  # options are made anew, with equal forms
        weigh(list_one(), task, KNOWN, SETTINGS, num_samples=20, rng=np.random.default_rng(0))
    assert planned == [task]
