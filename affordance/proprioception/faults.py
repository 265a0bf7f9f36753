"""Faults of torque sensors and of the arm model, all off by default.

Sensor faults distort measured torques after noise has been added. The controller always receives the true state. A
missing sample is NaN at all joints. A mass fault changes the simulated arm but not its models.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, RootModel
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.framework import Context

from affordance.arrays import Array
from affordance.exceptions import BadValueError, describe_choice
from affordance.files.constraints import CheckedFields, Name, Setting, Whole, Within
from affordance.files.data_model import DataModel, load_model
from affordance.plant.arm import Arm

# Bounds of values in a file. Values outside them belong to a different arm or have wrong units.
_TORQUE_MAX = 1e4  # [N m]
_TORQUE = Within(-_TORQUE_MAX, _TORQUE_MAX)
_PROBABILITY = Within(0.0, 1.0)
_BIAS = Within(-100.0, 100.0)
_DELAY = Whole(0, 100)
_MASS_FACTOR = Within(0.5, 2.0)
_NONE = "no fault, unless one is switched on (docs/decisions/0016-faults-and-surprise.md)"


@dataclass(frozen=True)
class Faults(CheckedFields):
    """Faults of sensors and arm. Several can be active at the same time.

    Attributes:
        nan_probability: Probability that one random joint of a sample reads NaN.
        drop_probability: Probability that a sample is missing.
        spike_probability: Probability that one random joint of a sample reads a spike.
        spike_height: Largest spike, [N m]; spikes are uniform between plus and minus this value.
        stuck_joint: Name of a joint whose sensor reads a constant torque; empty for none.
        stuck_torque: Torque that the stuck sensor reads, [N m].
        bias_sd: Bias of every joint, in standard deviations of its noise.
        delay_samples: Number of samples by which torques are delayed; angles and velocities are not.
        arm_mass_factor: Factor of mass and inertia of the simulated arm, relative to its models.
    """

    nan_probability: Annotated[float, _PROBABILITY, Setting("1", _NONE)] = 0.0
    drop_probability: Annotated[float, _PROBABILITY, Setting("1", _NONE)] = 0.0
    spike_probability: Annotated[float, _PROBABILITY, Setting("1", _NONE)] = 0.0
    spike_height: Annotated[float, Within(0.0, _TORQUE_MAX), Setting("N m", _NONE)] = 0.0
    stuck_joint: Annotated[str, Setting("", _NONE)] = ""
    stuck_torque: Annotated[float, _TORQUE, Setting("N m", _NONE)] = 0.0
    bias_sd: Annotated[float, _BIAS, Setting("1", _NONE)] = 0.0
    delay_samples: Annotated[int, _DELAY, Setting("1", _NONE)] = 0
    arm_mass_factor: Annotated[float, _MASS_FACTOR, Setting("1", _NONE)] = 1.0

    def distort(self, felt: Array, sd: Array, stuck: int | None, seed: tuple[int, ...]) -> Array:
        """Computes the torques that faulty sensors report, shape (num_joints,), [N m].

        Args:
            felt: Torques without faults, shape (num_joints,), [N m]. A missing sample is returned unchanged.
            sd: Standard deviations of their noise, shape (num_joints,), [N m].
            stuck: Index of ``stuck_joint``; None if no sensor is stuck.
            seed: Seed of the random faults.
        """
        if np.isnan(felt).all():
            return felt.copy()
        rng = np.random.default_rng(seed)
        if rng.random() < self.drop_probability:
            return np.full_like(felt, np.nan)
        reported: Array = felt + self.bias_sd * sd
        if stuck is not None:
            reported[stuck] = self.stuck_torque
        if rng.random() < self.spike_probability:
            reported[rng.integers(len(felt))] += rng.uniform(-self.spike_height, self.spike_height)
        if rng.random() < self.nan_probability:
            reported[rng.integers(len(felt))] = np.nan
        return reported

    def find_stuck(self, joint_names: Sequence[str]) -> int | None:
        """Returns the index of the joint with a stuck sensor, or None.

        Raises:
            BadValueError: The joint is unknown.
        """
        if not self.stuck_joint:
            return None
        if self.stuck_joint not in joint_names:
            raise BadValueError("faults", "stuck_joint", describe_choice(self.stuck_joint, joint_names))
        return list(joint_names).index(self.stuck_joint)

    def change_arm(self, arm: Arm, plant_context: Context) -> None:
        """Multiplies mass and inertia of the simulated arm, without the tool, by ``arm_mass_factor``."""
        if self.arm_mass_factor == 1.0:
            return
        instance = arm.hand.body().model_instance()
        for index in arm.plant.GetBodyIndices(instance):
            body = arm.plant.get_body(index)
            M = body.CalcSpatialInertiaInBodyFrame(plant_context)
            heavier = SpatialInertia(self.arm_mass_factor * M.get_mass(), M.get_com(), M.get_unit_inertia())
            body.SetSpatialInertiaInBodyFrame(plant_context, heavier)


NO_FAULTS = Faults()


class _FaultsEntry(DataModel):
    """Named fault in a file. Omitted fields have no fault."""

    nan_probability: Annotated[float, _PROBABILITY] = 0.0
    drop_probability: Annotated[float, _PROBABILITY] = 0.0
    spike_probability: Annotated[float, _PROBABILITY] = 0.0
    spike_height: Annotated[float, Within(0.0, _TORQUE_MAX)] = 0.0
    stuck_joint: Name | None = None
    stuck_torque: Annotated[float, _TORQUE] = 0.0
    bias_sd: Annotated[float, _BIAS] = 0.0
    delay_samples: Annotated[int, _DELAY] = 0
    arm_mass_factor: Annotated[float, _MASS_FACTOR] = 1.0


class FaultsFile(RootModel[Annotated[dict[str, _FaultsEntry], Field(min_length=1)]]):
    """Contents of a file of named faults."""


def load_faults(path: Path, names: Sequence[str], joint_names: Sequence[str]) -> Faults:
    """Loads named faults from a file and combines them. Without names, the result is NO_FAULTS.

    Raises:
        BadValueError: The file or a value is invalid, a name is unknown, or two faults set the same field.
    """
    known = {}
    for name, entry in load_model(path, FaultsFile).root.items():
        if entry.stuck_joint is not None and entry.stuck_joint not in joint_names:
            raise BadValueError(path, f"{name}.stuck_joint", describe_choice(entry.stuck_joint, joint_names))
        known[name] = Faults(**entry.model_dump(exclude_unset=True))
    together: dict[str, Any] = {}
    for name in dict.fromkeys(names):
        if name not in known:
            raise BadValueError("--fault", "", describe_choice(name, known))
        for field in fields(Faults):
            value = getattr(known[name], field.name)
            if value == field.default:
                continue
            if field.name in together:
                raise BadValueError("--fault", "", f"{name!r} sets {field.name}, which another fault already sets")
            together[field.name] = value
    return Faults(**together)
