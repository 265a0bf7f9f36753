"""Nearness of postures to rank loss, and messages about it."""

import re

import numpy as np
import pytest
from helpers.two_tools import STICK

from affordance.choice.reach import Reach
from affordance.control.timed_path import TimedPath, load_path
from affordance.files.model_folder import MODELS
from affordance.plant.rank_loss import MIN_MOBILITY, compute_mobility, describe_rank_loss
from affordance.settings import DEFAULT_SETTINGS

P_TQ = np.array([0.3, 0.0, 0.0])
PATH = load_path(MODELS / "paths" / "reach.yaml")


def test_mobility_is_how_far_the_point_moves_at_least(model, rng):
    """Mobility is, to 1 %, the least displacement of the point per unit step of the joints, by finite differences."""
    q = model.arm.find_posture(dict(PATH.start))

    def find_place(q):
        model.set_posture(q)
        return model.compute_point_position(P_TQ)

    J = np.column_stack([(find_place(q + h) - find_place(q - h)) / 2e-5 for h in 1e-5 * np.eye(7)])
    directions = rng.standard_normal((20_000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    reached = np.linalg.norm(directions @ J, axis=1)  # the most along each, per unit step of the joints
    mobility = compute_mobility(model, q, P_TQ)
    assert mobility <= reached.min() + 1e-6
    assert mobility == pytest.approx(reached.min(), rel=0.01)


def test_outstretched_arm_cannot_move_its_hand_along_itself(model):
    assert compute_mobility(model, model.arm.home, P_TQ) == pytest.approx(0.0, abs=1e-9)


def test_words_name_the_joint_that_leads_away_and_the_measure(model):
    # Nothing but the elbow folds an arm that is all but outstretched.
    q = model.arm.find_posture({"elbow_flexion": 0.02, "wrist_deviation": 0.0, "wrist_flexion": 0.0})
    said = describe_rank_loss(model, q, np.zeros(3))
    assert "\n" not in said
    (measured, bound, joint) = re.fullmatch(
        r"moves the free end by ([\d.e-]+) m per rad in its worst direction, must be at least ([\d.]+); "
        r"bend (\w+), which raises it most",
        said,
    ).groups()
    assert float(measured) == pytest.approx(compute_mobility(model, q, np.zeros(3)), rel=0.01)
    assert float(bound) == MIN_MOBILITY
    index = model.arm.joint_names.index(joint)
    raised = []
    for other in range(7):
        bent = [np.clip(q + sign * 0.1 * np.eye(7)[other], *model.arm.limits[:2]) for sign in (1.0, -1.0)]
        raised.append(max(compute_mobility(model, each, np.zeros(3)) for each in bent))
    assert index == int(np.argmax(raised))
    assert raised[index] > float(measured)


def test_path_that_leads_near_rank_loss_is_named_with_place_joint_and_measure(model):
    """A path to an all but outstretched arm, still within tolerance, is refused with place, joint and mobility."""
    outward = Reach(TimedPath(((0.19, 0.26, 0.12),), duration=2.0, tolerance=0.02, start=PATH.start))
    reason = outward.build_cost(model, STICK.components, DEFAULT_SETTINGS).infeasible_reason
    assert re.fullmatch(
        r"near point 1 of 1 at \[0\.19, 0\.26, 0\.12\], at t = [\d.]+ s, moves the free end by [\d.]+ m per rad in "
        r"its worst direction, must be at least 0\.05; bend \w+, which raises it most",
        reason,
    )


def test_path_straight_back_can_be_followed(model):
    """A path straight back by 0.2 m can be followed from the bent start, as it could not from an outstretched arm."""
    back = Reach(TimedPath(((-0.2, 0.0, 0.0),), duration=2.0, tolerance=0.02, start=PATH.start))
    for tool in STICK.list_gripped().values():
        cost = back.build_cost(model, tool.components, DEFAULT_SETTINGS)
        assert cost.infeasible_reason == ""
        (work,) = cost.compute(tool.parameters[None]).work
        assert work > 1.0  # it does move
