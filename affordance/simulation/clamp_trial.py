"""A trial in which the hand pushes against a clamp, which then lets go and hands over the object.

The force has a closed form (``control.clamp``). How far the hand moves then has none for the outstretched arm: a
belief that is a seventh too light makes it unstable, to first order, against turning its forearm, and what is beyond
decides how far it sinks. For hundreds of lifts it is simulated at some beliefs, and interpolated between.
"""

from typing import NamedTuple

import numpy as np
from pydrake.systems.analysis import ApplySimulatorConfig

from affordance.arguments import Seed
from affordance.belief.object_belief import Memory
from affordance.control.clamp import ClampAndRelease
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.objects.tool import Tool
from affordance.simulation.trial import TrialRunner, finish
from affordance.simulation.trial_record import TrialRecord

# How long the hand pushes; the force settles within a third of it, [s].
CLAMPED = 1.0
# The force is the mean over this time before release (Cesanek et al. 2021), at so many times, [s].
_AVERAGED = 0.01
_NUM_READINGS = 10
# Believed over true weight where excursions are tabulated: closer where the hand moves little.
_FACTORS = np.array([0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.35, 1.5, 1.75, 2.0])
# Times of logged rows are rounded, [s].
_ROUNDING = 1e-9


class ClampRecord(NamedTuple):
    """What happened at a clamp.

    Attributes:
        force: Upward force of the hand on it, the mean of the last 10 ms before release, [N].
        release_time: When it let go, [s].
        excursion: The farthest that the hand went up or, negative, down from where it was then, [m].
    """

    force: float
    release_time: float
    excursion: float


def run_clamp_and_release(
    runner: TrialRunner, tool: Tool, memory: Memory, *, duration: float, seed: Seed
) -> tuple[TrialRecord, ClampRecord]:
    """Pushes against a clamp with what an object is believed to weigh, then holds it.

    The hand is clamped where it is at home, and empty: the object is handed over at release, and only what is felt
    from then on is learned from.

    Args:
        runner: Runs it.
        tool: The object.
        memory: What is remembered before it.
        duration: How long it is held after release, [s].
        seed: Determines every random draw.

    Returns: What happened from the beginning, and at the clamp.
    """
    trial = runner.get_diagram(CLAMPED + duration, has_clamp=True)
    arm = trial.arm
    assert arm.clamp is not None  # the Diagram was built with one
    task = ClampAndRelease(arm.home, CLAMPED)
    simulator = runner.prepare(trial, tool, task, memory, seed)
    context = simulator.get_mutable_context()
    plant_context = arm.plant.GetMyMutableContextFromRoot(context)
    arm.set_payload(plant_context, np.zeros(NUM_PARAMETERS))
    arm.clamp.close(plant_context)
    up = -trial.chain.gravity_W / np.linalg.norm(trial.chain.gravity_W)
    readings = []
    for time in np.linspace(CLAMPED - _AVERAGED, CLAMPED, _NUM_READINGS + 1)[1:]:
        simulator.AdvanceTo(float(time))
        readings.append(float(arm.clamp.compute_force(plant_context) @ up))
    arm.clamp.release(plant_context)
    arm.set_payload(plant_context, tool.parameters)
    trial.estimator.forget(trial.estimator.GetMyMutableContextFromRoot(context))
    config = runner.settings.simulator
    config.start_time = context.get_time()  # or the clock would be set back
    ApplySimulatorConfig(config, simulator)
    record = finish(trial, simulator, tool)
    height = record.height_grip[record.times >= CLAMPED - _ROUNDING]
    return record, ClampRecord(float(np.mean(readings)), CLAMPED, max(height - height[0], key=abs))
