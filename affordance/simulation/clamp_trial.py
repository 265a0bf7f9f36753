"""Trial in which the hand pushes against a clamp, which then opens and hands over the object.

The force has a closed form (``control.hold``). The hand's motion after release has none if the arm is outstretched:
if the believed weight is a seventh too small, rotating the forearm is unstable to first order, and higher-order terms
determine how far the arm sinks.
"""

from typing import NamedTuple

import numpy as np
from pydrake.systems.analysis import ApplySimulatorConfig

from affordance.arguments import Seed
from affordance.belief.material_memory import MaterialMemory
from affordance.control.hold import ClampAndRelease
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.objects.tool import Tool
from affordance.simulation.trial import TrialRunner, finish
from affordance.simulation.trial_record import TrialRecord

# Duration of the push, [s]; the force settles within a third of it.
CLAMPED = 1.0
# Time before release over which the force is averaged (Cesanek et al. 2021), [s], and number of readings.
_AVERAGED = 0.01
_NUM_READINGS = 10
# Rounding error of the times of logged rows, [s].
_ROUNDING = 1e-9


class ClampRecord(NamedTuple):
    """Force on a clamp, and the hand's motion after release."""

    force: float  # upward force of the hand on the clamp, averaged over the last 10 ms before release, [N]
    release_time: float  # time of the release, [s]
    excursion: float  # largest vertical displacement of the hand after release, positive upwards, [m]


def run_clamp_and_release(
    runner: TrialRunner, tool: Tool, memory: MaterialMemory, *, duration: float, seed: Seed
) -> tuple[TrialRecord, ClampRecord]:
    """Pushes against a clamp with the believed weight of an object, then holds the object for a duration, [s].

    The hand is clamped in its home pose, and empty. The object is handed over at release, and only measurements after
    that are used for learning.
    """
    trial = runner.get_diagram(CLAMPED + duration, has_clamp=True)
    arm = trial.arm
    assert arm.clamp is not None  # the Diagram was built with a clamp
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
    config = runner.settings.integrator.free
    config.start_time = context.get_time()  # otherwise the clock would be reset
    ApplySimulatorConfig(config, simulator)
    record = finish(trial, simulator, tool)
    height = record.height_grip[record.times >= CLAMPED - _ROUNDING]
    return record, ClampRecord(float(np.mean(readings)), CLAMPED, max(height - height[0], key=abs))
