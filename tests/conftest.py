"""Fixtures that several modules share. Plants and Diagrams take long to build, so one of each serves a process."""

from collections.abc import Iterator

import numpy as np
import pytest
from helpers.children import Start, keep_children

from affordance.experiments.holding import HoldExperiment
from affordance.experiments.protocol_runs import load_hold_experiment
from affordance.plant.arm import Arm, load_arm
from affordance.plant.arm_model import ArmModel
from affordance.plant.serial_chain import SerialChain, build_chain
from affordance.simulation.trial import TrialRunner


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20261120)


@pytest.fixture
def children() -> Iterator[Start]:
    """Starts processes, which end with the test."""
    with keep_children() as start:
        yield start


@pytest.fixture(scope="session")
def arm() -> Arm:
    return load_arm()


@pytest.fixture
def model(arm: Arm) -> ArmModel:
    return ArmModel(arm)


@pytest.fixture(scope="session")
def chain(arm: Arm) -> SerialChain:
    return build_chain(arm)


@pytest.fixture(scope="session")
def weight() -> HoldExperiment:
    return load_hold_experiment("weight")


@pytest.fixture(scope="session")
def runner(weight: HoldExperiment) -> TrialRunner:
    return TrialRunner(weight.settings)
