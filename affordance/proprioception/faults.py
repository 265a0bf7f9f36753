"""Faults of sensors and of the arm's model, as data that can be switched on; by default there is none.

Faults of sensors distort measured torques, after their noise; the controller sees the true state, as always. A
sample that does not arrive is NaN at every joint. The heavier arm is the one that is moved: models keep their own.
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
from affordance.checked_fields import Setting, check_fields
from affordance.exceptions import BadValueError, describe_choice
from affordance.files.data_model import DataModel, Text, Whole, Within, load_model
from affordance.plant.arm import Arm

# Bounds of what a file may ask for; beyond them an arm is no longer the arm, or a slip of units was made.
_TORQUE_MAX = 1e4  # [N m]
_TORQUE = Within(-_TORQUE_MAX, _TORQUE_MAX)
_PROBABILITY = Within(0.0, 1.0)
_BIAS = Within(-100.0, 100.0)
_DELAY = Whole(0, 100)
_MASS_FACTOR = Within(0.5, 2.0)
_NONE = "no fault, unless one is switched on (docs/decisions/0016-faults-and-surprise.md)"


@dataclass(frozen=True)
class Faults:
    """What is wrong; several can be at once.

    Attributes:
        nan_probability: Probability that in a sample one joint, any, reads NaN.
        drop_probability: Probability that a sample does not arrive.
        spike_probability: Probability that in a sample one joint, any, reads a spike.
        spike_height: Bound of spikes, which add something between minus and plus it, each equally probable, [N m].
        stuck_joint: Name of a joint whose sensor reads one torque whatever it carries; empty for none.
        stuck_torque: Torque that this sensor reads, [N m].
        bias_sd: Bias of every joint, in standard deviations of its noise.
        delay_samples: Number of samples by which torques arrive late; angles and velocities do not.
        arm_mass_factor: Mass and inertia of the arm that is moved, over those of its models.
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

    def __post_init__(self) -> None:
        """Checks the numbers.

        Raises:
            BadArgumentError: One is not finite, or out of bounds.
        """
        check_fields(self)

    def distort(self, felt: Array, sd: Array, stuck: int | None, seed: tuple[int, ...]) -> Array:
        """Returns what the sensors report in place of the torques felt, shape (num_joints,), [N m].

        Args:
            felt: Torques with the noise of feeling, shape (num_joints,), [N m]; a sample that is NaN at every joint
                did not arrive, and no fault brings it back.
            sd: Standard deviations of that noise, shape (num_joints,), [N m].
            stuck: Index of ``stuck_joint``; None if there is none.
            seed: Determines what is random in this sample.
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
        """Returns the index of the joint whose sensor is stuck, or None.

        Raises:
            BadValueError: The arm has no such joint.
        """
        if not self.stuck_joint:
            return None
        if self.stuck_joint not in joint_names:
            raise BadValueError("faults", "stuck_joint", describe_choice(self.stuck_joint, joint_names))
        return list(joint_names).index(self.stuck_joint)

    def change_arm(self, arm: Arm, plant_context: Context) -> None:
        """Makes the bodies of the arm, not the tool, as heavy as they are in truth."""
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
    """Faults as a file has them; what is left out is as it should be."""

    nan_probability: Annotated[float, _PROBABILITY] = 0.0
    drop_probability: Annotated[float, _PROBABILITY] = 0.0
    spike_probability: Annotated[float, _PROBABILITY] = 0.0
    spike_height: Annotated[float, Within(0.0, _TORQUE_MAX)] = 0.0
    stuck_joint: Annotated[str, Text()] | None = None
    stuck_torque: Annotated[float, _TORQUE] = 0.0
    bias_sd: Annotated[float, _BIAS] = 0.0
    delay_samples: Annotated[int, _DELAY] = 0
    arm_mass_factor: Annotated[float, _MASS_FACTOR] = 1.0


class FaultsFile(RootModel[Annotated[dict[str, _FaultsEntry], Field(min_length=1)]]):
    """A file of named faults."""


def load_faults(path: Path, names: Sequence[str], joint_names: Sequence[str]) -> Faults:
    """Reads named faults from a file, all of which is checked, and puts those asked for together.

    Args:
        path: A mapping from names to the fields of Faults that differ from their defaults.
        names: Which of them to switch on; none gives NO_FAULTS.
        joint_names: Those of the arm.

    Raises:
        BadValueError: The file or one of its values is wrong, a name is not in it, or two faults set one field.
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
                raise BadValueError("--fault", "", f"{name!r} sets {field.name}, which another fault sets already")
            together[field.name] = value
    return Faults(**together)
