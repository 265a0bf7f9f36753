import dataclasses

import numpy as np
import pytest
from helpers.two_tools import REACH, STEEL, STICK, WOOD

from affordance.choice.motion_cost import measure_cost
from affordance.settings import DEFAULT_SETTINGS, Integrator
from affordance.simulation.rollout import Rollout, roll_out


def test_error_is_the_largest_distance_at_any_one_time():
    """The error is 5 m of distances 0, 5 and 3 m, though the second point lies on the reference at another time."""
    path = np.array([[1.0, 2.0, 3.0], [4.0, 6.0, 3.0], [4.0, 6.0, 6.0]])
    reference = np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [4.0, 6.0, 3.0]])
    rollout = Rollout(0.0, 0.0, path, reference, None)
    assert rollout.error == 5.0


@pytest.fixture(scope="module")
def tool():
    return STICK.gripped_by(STICK.grips[0])


@pytest.fixture(scope="module")
def rollout(tool):
    """Rollout integrated more exactly than in the experiments, so that no error of the integrator remains."""
    densities = {WOOD: 720.0, STEEL: 7850.0}
    return roll_out(
        tool, REACH, densities, dataclasses.replace(DEFAULT_SETTINGS, integrator=Integrator(accuracy=1e-8))
    )


def compute_energies(arm, tool, record):
    """Kinetic and potential energy of arm and tool at every row, by Drake, [J]."""
    context = arm.plant.CreateDefaultContext()
    arm.set_payload(context, tool.with_densities({WOOD: 720.0, STEEL: 7850.0}).parameters)
    energies = []
    for x in np.hstack([record.q, record.v]):
        arm.plant.SetPositionsAndVelocities(context, x)
        energies.append((arm.plant.CalcKineticEnergy(context), arm.plant.CalcPotentialEnergy(context)))
    return np.array(energies)


def test_joints_do_the_work_that_kinetic_and_potential_energy_gain(arm, tool, rollout):
    """Energy gained in every control period is tau . (q_k - q_k-1), to 1e-5 of the largest work of a period."""
    record = rollout.record
    energies = compute_energies(arm, tool, record)
    work = (record.tau[1:] * np.diff(record.q, axis=0)).sum(axis=1)
    np.testing.assert_allclose(np.diff(energies.sum(axis=1)), work, rtol=0, atol=1e-5 * np.abs(work).max())
    # Both kinds change by far more than that, or one of them could be missing.
    assert (np.ptp(energies, axis=0) > 0.1).all()


def test_work_is_absolute_what_is_driven_and_what_is_braked(arm, tool, rollout):
    """Gained energy is work W+ put in less W- taken out; absolute work is their sum."""
    record, control_period = rollout.record, DEFAULT_SETTINGS.control_period
    works = record.tau[1:] * np.diff(record.q, axis=0)
    driven, braked = works[works > 0.0].sum(), -works[works < 0.0].sum()
    gained = np.diff(compute_energies(arm, tool, record).sum(axis=1)[[0, -1]])[0]
    assert driven - braked == pytest.approx(gained, abs=1e-5 * driven)
    # Within a period in which a joint turns around, the mean velocity hides a little of both.
    assert rollout.work == pytest.approx(driven + braked, rel=2e-3)
    assert rollout.work == pytest.approx(gained + 2.0 * braked, rel=2e-3)
    assert braked > 0.1 * driven
    without_signs = measure_cost(np.abs(record.tau), record.v, control_period)
    assert without_signs == pytest.approx((rollout.work, rollout.effort))
