"""Start postures of tasks: data of their files, and the rule by which they were chosen."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import minimize

from affordance.choice.hammer import load_hammer
from affordance.choice.reach import Reach
from affordance.control.timed_path import load_path
from affordance.exceptions import AffordanceError
from affordance.files.model_folder import MODELS
from affordance.plant.rank_loss import MIN_MOBILITY, compute_mobility

REACH = MODELS / "paths" / "reach.yaml"
# 30 cm beyond the hand, where tools end.
P_TF = np.array([0.3, 0.0, 0.0])


def list_starts():
    """The starts of all tasks that have one."""
    return {
        "reach": load_path(REACH).start,
        "mash": load_path(MODELS / "paths" / "mash.yaml").start,
        "hammer": load_hammer(MODELS / "nail.yaml").start,
    }


def test_all_tasks_start_in_the_same_posture():
    starts = list_starts()
    assert len(set(starts.values())) == 1


def test_start_is_the_only_posture_nearest_to_the_middle_of_all_ranges(model):
    """Searches from random postures find none nearer to the middle with the hand straight ahead and level."""
    arm = model.arm
    lower, upper = arm.limits.q_lower, arm.limits.q_upper
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)

    def compute_hand_axis(q):
        model.set_posture(q)
        return model.compute_hand_pose().rotation().matrix()[:, 0]

    def search(q):
        return minimize(
            lambda q: np.sum(((q - middle) / half) ** 2),
            q,
            method="SLSQP",
            bounds=list(zip(lower, upper, strict=True)),
            constraints={"type": "eq", "fun": lambda q: compute_hand_axis(q)[1:]},
            options={"maxiter": 300, "ftol": 1e-12},
        )

    rng = np.random.default_rng(0)
    ahead = []
    while len(ahead) < 5:
        found = search(rng.uniform(lower, upper))
        if found.success and compute_hand_axis(found.x)[0] > 0.0:  # the others point back
            ahead.append(found)
    least = min(ahead, key=lambda found: found.fun)
    nearest = [found for found in ahead if found.fun < least.fun + 1e-6]
    assert len(nearest) >= 3
    for found in nearest:
        np.testing.assert_allclose(found.x, arm.find_posture(dict(list_starts()["reach"])), atol=1e-3)


def test_start_is_farther_from_rank_loss_than_asked_for(model):
    mobility = compute_mobility(model, model.arm.find_posture(dict(list_starts()["reach"])), P_TF)
    assert mobility > 3.0 * MIN_MOBILITY


@pytest.mark.parametrize(
    ("file", "load"),
    [
        ("nail.yaml", lambda path: load_hammer(path).start),
        ("paths/reach.yaml", lambda path: load_path(path).start),
    ],
)
def test_start_is_the_home_posture_unless_said_otherwise(tmp_path, arm, file, load):
    lines = (MODELS / file).read_text().splitlines()
    (place,) = (number for number, line in enumerate(lines) if line.strip() == "start:")
    path = tmp_path / "task.yaml"
    path.write_text("\n".join(lines[:place]))
    assert load(path) == ()
    np.testing.assert_array_equal(arm.find_posture(dict(load(path))), arm.home)
    path.write_text("\n".join([*lines[: place + 1], "      elbow_flexion: 0.7"]))
    (posture,) = load(path)
    assert posture == ("elbow_flexion", 0.7)
    expected = np.array(arm.home)
    expected[arm.joint_names.index("elbow_flexion")] = 0.7
    np.testing.assert_array_equal(arm.find_posture(dict(load(path))), expected)


def test_reaching_from_an_outstretched_arm_is_refused_with_the_joint_to_bend(model):
    """Reaching from an outstretched arm is refused in one line that names a joint to bend."""
    outstretched = Reach(dataclasses.replace(load_path(REACH), start=()))
    with pytest.raises(
        AffordanceError, match=r"^the start moves the free end by 0 m per rad .* bend (\w+), "
    ) as caught:
        outstretched.begin(model, P_TF)
    assert "\n" not in str(caught.value)
