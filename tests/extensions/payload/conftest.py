"""A generated robot serves all tests of this folder; reading its file takes longer than most of them."""

import numpy as np
import pytest
from helpers.generated_runs import build_robot

from affordance.extensions.payload.evidence.gains import Gains, build_nominal_gains
from affordance.extensions.payload.evidence.joint_statistics import ChannelSamples
from affordance.extensions.payload.settings import DEFAULT_SETTINGS, SignalKind
from affordance.plant.serial_chain import SerialChain


@pytest.fixture(scope="session")
def robot(tmp_path_factory: pytest.TempPathFactory) -> SerialChain:
    return build_robot(tmp_path_factory.mktemp("robot"))


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20261121)


@pytest.fixture(scope="session")
def gains(robot: SerialChain) -> Gains:
    """Gains of the robot's torque sensors."""
    return build_nominal_gains(robot.joint_names, SignalKind.JOINT_TORQUE, DEFAULT_SETTINGS)


@pytest.fixture
def samples(rng: np.random.Generator) -> ChannelSamples:
    """Sixty random samples of three channels."""
    d, s = np.sign(rng.standard_normal((2, 60, 3)))
    tau_arm, v, signal = rng.standard_normal((3, 60, 3))
    Y, used, vdot = rng.standard_normal((60, 3, 10)), rng.random((60, 3)) > 0.2, rng.standard_normal((60, 3))
    return ChannelSamples(Y, tau_arm, d * s, d, v, vdot, signal, used)
