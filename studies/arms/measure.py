"""Sag of an arm that is given an object heavier than it believes, and its prediction by a formula.

The arm sags until the torque of its plan, which is the planned acceleration times the believed inertia, balances the
unforeseen torque. A plan of minimum acceleration in N steps from rest, at a distance e from its goal, starts with an
acceleration of 6 N / (N + 1) e / T^2, so

    e = (1 + 1 / N) T^2 / 6 M^-1 Y (pi - pi_believed)

where M is the mass matrix under the believed load, for a torque that is held constant in each step
(plant/arm_model.py). The heavier arm and rotors are at the hand, the less the arm sags: along the vertical, by
(1 + 1 / N) T^2 g / 6 times the unforeseen mass, divided by the sum of the arm's own effective mass and the believed
mass.
"""

import dataclasses
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from affordance.belief.material_memory import MaterialMemory
from affordance.named_settings import NO_CHANGES, Changes, change_settings
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.plant.arm import ARM
from affordance.plant.arm_model import ArmModel, HeldTorqueModel, compute_payload_regressor
from affordance.plant.load import load_arm
from affordance.settings import Settings
from affordance.simulation.trial import TrialRunner

# Duration of a hold, long enough for the sag to reach its end, [s].
_HOLD = 1.5
# Number of timed holds. The fastest one counts, because other processes can only slow a hold down, and because the
# first hold also builds the Diagram.
_TIMES = 3


class Sag(NamedTuple):
    """Sag in the first hold of Simulation I."""

    arm_mass: float  # effective mass of the empty arm at the hand along the vertical, [kg]
    object_mass: float  # mass of the object, [kg]
    predicted: float  # fall of the object's centre by the formula above, [m]
    simulated: float  # fall of the object's centre in Drake, [m]
    rate: float  # largest ratio of a joint's velocity to its limit, [1]
    rate_joint: str  # name of that joint
    limited: float  # fraction of the control periods in which a limit was active
    real_time_factor: float  # simulated time divided by processor time, in the fastest hold


def measure_sag(
    models: Path, tool_index: int = 0, task_models: Path | None = None, changes: Changes = NO_CHANGES
) -> Sag:
    """Simulates a hold by an arm without experience, which is given an object of Simulation I.

    The objects come from the arm's folder of models, or from ``task_models`` if given.
    """
    settings = change_settings(Settings(arm=models / ARM.name), changes)
    settings = dataclasses.replace(settings, log_period=settings.control_period)
    folder = task_models or models
    tool = load_tools(folder / "tools" / "weight.yaml", load_materials(folder / "materials.yaml"))[tool_index]
    arm = load_arm(settings.arm)
    # Without experience, the arm believes that every material has the most probable density under the prior.
    believed = tool.with_densities({part.looks_like.colour: settings.prior.mode for part in tool.components})
    home = np.concatenate([arm.home, np.zeros(arm.num_joints)])
    plain, held = ArmModel(arm), HeldTorqueModel(arm, settings.control_period)
    plain.set_state(home)
    up = np.array([0.0, 0.0, 1.0])
    lift = up @ plain.compute_point_jacobian(np.zeros(3))
    arm_mass = 1.0 / float(lift @ np.linalg.solve(plain.compute_mass_matrix(), lift))
    Y = compute_payload_regressor(plain, home, np.zeros(arm.num_joints))
    held.set_payload(believed.parameters)
    held.set_state(home)
    unforeseen = Y @ (tool.parameters - believed.parameters)
    compliance = (1.0 + 1.0 / settings.mpc.num_steps) * settings.mpc.horizon**2 / 6.0
    e = compliance * np.linalg.solve(held.compute_mass_matrix(), unforeseen)
    predicted = float(up @ held.compute_point_jacobian(tool.p_TTcentre) @ e)

    runner = TrialRunner(settings)
    seconds = []
    for _ in range(_TIMES):
        start = time.process_time()
        record = runner.run_hold(tool, MaterialMemory(), duration=_HOLD, seed=(0,))
        seconds.append(time.process_time() - start)
    rates = np.abs(record.v).max(axis=0) / arm.limits.v_max
    return Sag(
        arm_mass,
        tool.mass,
        predicted,
        float(max(0.0, -record.height_centre.min())),
        float(rates.max()),
        arm.joint_names[int(np.argmax(rates))],
        record.counts.limited * settings.control_period / _HOLD,
        _HOLD / min(seconds),
    )
