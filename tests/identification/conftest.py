"""A generated robot serves all tests of this folder; reading its file takes longer than most of them."""

import numpy as np
import pytest
from helpers.generated_runs import build_robot

from affordance.identification.recording.robot_chain import RobotChain


@pytest.fixture(scope="session")
def robot(tmp_path_factory: pytest.TempPathFactory) -> RobotChain:
    return build_robot(tmp_path_factory.mktemp("robot"))


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20261121)
