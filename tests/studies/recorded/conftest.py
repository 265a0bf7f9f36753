"""A generated robot serves all tests of this folder."""

import pytest
from helpers.generated_runs import build_robot

from affordance.plant.serial_chain import SerialChain


@pytest.fixture(scope="session")
def robot(tmp_path_factory: pytest.TempPathFactory) -> SerialChain:
    return build_robot(tmp_path_factory.mktemp("robot"))
