import numpy as np
import pytest

from affordance.objects.inertia import DENSITY_MAX, Geometry
from affordance.proprioception.outlier_check import SampleStatus, check_reading, check_torque
from affordance.proprioception.torque_noise import WeberNoise

NOISE = WeberNoise(0.07, 0.097)


@pytest.mark.parametrize(
    ("tau", "status"),
    [
        ([1.0, -2.0], SampleStatus.ACCEPTED),
        ([np.nan, np.nan], SampleStatus.MISSING),
        ([1.0, np.nan], SampleStatus.NOT_FINITE),
        ([np.inf, 1.0], SampleStatus.NOT_FINITE),
        ([-np.inf, np.nan], SampleStatus.NOT_FINITE),
    ],
)
def test_reading_is_judged_by_what_is_finite(tau, status):
    assert check_reading(np.array(tau)) is status


@pytest.fixture(scope="module")
def held(hold, weight):
    tool = weight.tools[2]
    Phi = (tool.parameters / tool.components[0].material.density)[:, None]
    return hold, Geometry(Phi, np.zeros((0, 10, 1)))


def test_every_density_there_can_be_is_possible(held):
    hold, geometry = held
    for density in (0.1, 720.0, 8500.0, DENSITY_MAX):
        tau = hold.tau_arm + hold.Y @ geometry.Phi[:, 0] * density
        assert check_torque(tau, hold.tau_arm, hold.Y, geometry, NOISE) is SampleStatus.ACCEPTED


def test_torque_no_object_can_cause_is_impossible_whichever_way(held):
    hold, geometry = held
    heaviest = hold.tau_arm + hold.Y @ geometry.Phi[:, 0] * DENSITY_MAX
    for joint in range(7):
        for sign in (-1.0, 1.0):
            tau = hold.tau_arm.copy()
            tau[joint] = max(heaviest[joint], hold.tau_arm[joint], key=lambda value: sign * value)
            tau[joint] += sign * 5.9 * NOISE.compute_sd(np.abs([heaviest, hold.tau_arm]).max(axis=0))[joint]
            assert check_torque(tau, hold.tau_arm, hold.Y, geometry, NOISE) is SampleStatus.ACCEPTED
            tau[joint] += sign * 0.2 * NOISE.compute_sd(np.abs([heaviest, hold.tau_arm]).max(axis=0))[joint]
            assert check_torque(tau, hold.tau_arm, hold.Y, geometry, NOISE) is SampleStatus.IMPOSSIBLE


def test_uncertain_geometry_allows_for_more(held):
    hold, geometry = held
    tau = hold.tau_arm.copy()
    tau[2] = 2.0  # this joint carries no load of an object that lies where it was seen
    assert check_torque(tau, hold.tau_arm, hold.Y, geometry, NOISE) is SampleStatus.IMPOSSIBLE
    aside = np.zeros((1, 10, 1))
    aside[0, 3] = 0.05 * geometry.Phi[0]  # five centimetres to the side
    unsure = Geometry(geometry.Phi, aside)
    assert check_torque(tau, hold.tau_arm, hold.Y, unsure, NOISE) is SampleStatus.ACCEPTED
