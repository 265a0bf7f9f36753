"""``affordance feed-forward``: torques against gravity are those of Drake and of potential energies."""

import json

import numpy as np
import pytest
from helpers.answers import answer
from helpers.refusals import refuse_command
from numpy.testing import assert_allclose

from affordance import Robot, load_robot
from affordance.files.model_folder import MODELS
from affordance.plant.load import HAND_FRAME, load_arm

POSTURE = [0.1, 0.5, -0.2, 1.2, 0.3, 0.3, -0.4]
CENTRE, MASS, SDS = np.array([0.02, -0.01, 0.08]), 0.7, [0.02, 0.003, 0.002, 0.004]


@pytest.fixture
def payload(tmp_path):
    parameters = MASS * np.array([1.0, *CENTRE])
    content = {"frame": HAND_FRAME, "trusted": True, "parameters": parameters.tolist()}
    path = tmp_path / "belief.json"
    path.write_text(json.dumps(content | {"parameters_covariance": np.diag(np.square(SDS)).tolist()}))
    return path


def ask(*words, status=0):
    return answer("feed-forward", "--posture", *POSTURE, "--json", *words, status=status).content


def test_the_arms_torques_are_drakes():
    arm = load_arm(Robot().directives)
    context = arm.plant.CreateDefaultContext()
    arm.plant.SetPositions(context, POSTURE)
    content = ask()
    assert_allclose(content["arm_nm"], -arm.plant.CalcGravityGeneralizedForces(context), atol=1e-9)
    assert content["payload_nm"] == [0.0] * 7


def test_the_payloads_torques_are_slopes_of_its_potential_energy(payload):
    robot, step = load_robot(MODELS, HAND_FRAME), 1e-6

    def compute_slopes(of_point):
        q = np.array(POSTURE) + step * np.concatenate([np.eye(7), -np.eye(7)])
        height = robot.compute_positions(q, of_point)[:, 2]
        return 9.81 * (height[:7] - height[7:]) / (2.0 * step)

    content = ask("--payload", payload)
    assert_allclose(content["payload_nm"], MASS * compute_slopes(CENTRE), atol=1e-7)
    assert_allclose(content["sum_nm"], np.add(content["arm_nm"], content["payload_nm"]))
    # A first moment of 1 kg m along an axis is the slope's change per metre.
    columns = [compute_slopes(np.zeros(3)), *(compute_slopes(e) - compute_slopes(np.zeros(3)) for e in np.eye(3))]
    assert_allclose(content["payload_sd_nm"], np.sqrt(np.square(SDS) @ np.square(columns)), atol=1e-7)


def test_errors_of_the_links_grow_with_their_weight():
    small, large, none = (ask("--link-error", error)["sum_sd_nm"] for error in (0.05, 0.1, 0.0))
    assert_allclose(large, np.multiply(2.0, small))
    assert none == [0.0] * 7


def test_the_table_names_joints_and_assumptions(payload):
    said = answer("feed-forward", "--payload", payload, "--posture", *POSTURE)
    assert said.lines[0] == "Torques that hold belief.json at rest against gravity"
    assert len(said.lines) == 1 + 1 + 7 + 1
    assert "each link's weight is right to 10 %" in said.lines[-1]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("", "--posture: is missing, must have 7: "),
        ("--posture 0 0", "--posture: has 2 angles, must have 7: "),
        ("--posture 0 0 0 0 0 0 nan", "--posture: has an angle or --gravity a number that is not finite"),
        ("--posture 0 0 0 0 0 0 0 --link-error 2", "--link-error: is 2"),
        ("--posture 0 0 0 0 0 0 0 --tip elbow --payload {}", "--tip: is 'elbow', must be the payload's frame"),
    ],
)
def test_bad_input_is_refused_in_a_line(payload, words, said):
    assert said in refuse_command("feed-forward", *words.format(payload).split())
