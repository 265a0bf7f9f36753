"""Expectation of a payload on the generated robot, and limits of its motion."""

import numpy as np
import pytest
from helpers.generated_runs import THETA

from affordance.extensions.payload.evidence.gains import Gains
from affordance.extensions.payload.evidence.model_error import build_phantom_covariance
from affordance.extensions.payload.excitation.expectation import Expectation
from affordance.extensions.payload.excitation.planned_motion import MotionLimits
from affordance.plant.serial_chain import SerialChain


@pytest.fixture
def expectation(robot: SerialChain, gains: Gains) -> Expectation:
    return Expectation(robot, gains, np.full(6, 0.01), THETA[None], build_phantom_covariance(0.01))


@pytest.fixture
def limits() -> MotionLimits:
    bound = np.full(6, 1.0)
    return MotionLimits(-1.5 * bound, 1.5 * bound, 2.0 * bound, 3.0 * bound, 200.0 * bound, 1.0)
