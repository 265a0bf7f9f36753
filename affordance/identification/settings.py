"""What identification assumes, each number with its source; every nuisance can be switched off.

Where a number was found on a recording, docs/decisions/0020-recorded-data.md says on which, and what else was seen.
"""

import enum
from dataclasses import dataclass
from typing import Annotated

from affordance.arguments import SEED_MAX
from affordance.checked_fields import check_fields
from affordance.files.data_model import Whole, Within

NUM_SAMPLES = Whole(100, 1_000_000)
MIN_SPEED = Within(0.0, 10.0)  # [rad/s]
_SHARE = Within(0.0, 10.0)


class SignalKind(enum.Enum):
    """What a run's signal is; nothing in a file of efforts says so, and it decides what friction is in it."""

    JOINT_TORQUE = "joint_torque"  # link-side torque sensors: gear friction is not in it
    MOTOR_TORQUE = "motor_torque"  # motor current times a gain the maker gives: gear friction is in it
    CURRENT = "current"  # motor current: gear friction is in it, and gains are unknown
    WRENCH = "wrench"  # force and torque of a sensor at the wrist

    @property
    def unit(self) -> str:
        """Unit of the signal."""
        return {"current": "A", "wrench": "N, N m"}.get(self.value, "N m")


@dataclass(frozen=True)
class SignalPrior:
    """What is known of a kind of signal before a run.

    Attributes:
        gain_sd: Of the gain about its nominal value, channel by channel and run by run, as a fraction.
        load_friction: Mean of mu, friction as a fraction of the load.
        load_friction_sd: Its standard deviation, before any calibration.
        friction_sd: Of Coulomb friction, viscous friction (per rad/s) and offset, or of what a second run changed
            in them, in the signal's unit.
    """

    gain_sd: float
    load_friction: float
    load_friction_sd: float
    friction_sd: float


# Gains drift from run to run: in windows of 6 s of a UR10e with a known load the
# loaded joints' scatter by 1.6 to 4.3 %, their own error included; 2 % is assumed. Torque
# sensors: 1 %, what strain gauges hold; an assumption.
# mu: a UR10e's gears lose 3 to 10 % of the load, servos a third: before calibration 5 +- 7 %; servos want their own.
# Friction of a UR10e may change by some tenths of an ampere from run to run; 3 N m at 10 N m/A.
_PRIORS = {
    SignalKind.JOINT_TORQUE: SignalPrior(0.01, 0.0, 0.0, 0.3),
    SignalKind.MOTOR_TORQUE: SignalPrior(0.02, 0.05, 0.07, 3.0),
    SignalKind.CURRENT: SignalPrior(0.02, 0.05, 0.07, 0.3),
    # A strain-gauge sensor's calibration holds to about 1 %; its offset drifts by some newtons with temperature.
    SignalKind.WRENCH: SignalPrior(0.01, 0.0, 0.0, 3.0),
}


@dataclass(frozen=True)
class IdentificationSettings:
    """Settings of one identification; None leaves a number to the kind of signal.

    Attributes:
        gains: Whether gains are uncertain.
        load_friction: Whether friction grows with the load.
        friction: Whether friction and offsets change between runs.
        tare: Whether what an empty hand seems to hold is taken off (model and wrist analyses).
        floor: Whether the error of the arm's model that does not average out is added.
        correlated_noise: Whether neighbouring errors are taken to agree as much as they do.
        signal_prior: In place of that of the kind of signal.
        load_friction_drift: Of mu from run to run, once calibrated.
        friction_drift: Of friction and offset that were calibrated, as a fraction.
        gain_common_sd: Of a factor on all gains, where they come from the arm's file.
        gain_own_sd: Of each gain beside that factor, likewise.
        min_speed: Below it friction has no sure direction; such samples of a joint are left out, [rad/s].
        cutoff_factor: Cut-off of the low-pass filter as a multiple of the motion's bandwidth.
        trim: Left out at either end, where filters ring, [s].
        block: Length of the blocks by which agreement of neighbouring errors is measured, [s].
        max_rate: Rate to which faster runs are thinned out after filtering, [Hz].
        repeat_tolerance: Largest difference of a joint angle between two runs of one motion, [rad].
        num_samples: Samples of the posterior.
        unseen_share: Standard deviation of the mass a camera did not see, as a fraction of all.
        seed: Of the samples.
    """

    gains: bool = True
    load_friction: bool = True
    friction: bool = True
    tare: bool = True
    floor: bool = True
    correlated_noise: bool = True
    signal_prior: SignalPrior | None = None
    load_friction_drift: Annotated[float, _SHARE] = 0.02  # as the gains'
    friction_drift: Annotated[float, _SHARE] = 0.1  # lubricants thin by some per cent a kelvin
    # Currents of an empty UR10e against the torques of its URDF: gains of joints 1 to 3 are off by up to 50 %.
    gain_common_sd: Annotated[float, _SHARE] = 0.20
    gain_own_sd: Annotated[float, _SHARE] = 0.12
    min_speed: Annotated[float, MIN_SPEED] = 0.03  # below it the sign of a filtered velocity flickers
    # A fourth-order Butterworth passes a quarter of its cut-off to 1e-5.
    cutoff_factor: Annotated[float, Within(0.1, 1e3)] = 4.0
    trim: Annotated[float, Within(0.0, 1e3)] = 1.0
    block: Annotated[float, Within(1e-3, 1e3)] = 2.0  # errors agree over 0.3 to 1 s
    max_rate: Annotated[float, Within(1.0, 1e5)] = 100.0
    repeat_tolerance: Annotated[float, Within(0.0, 10.0)] = 0.02
    num_samples: Annotated[int, NUM_SAMPLES] = 2000
    unseen_share: Annotated[float, _SHARE] = 0.2
    seed: Annotated[int, Whole(0, SEED_MAX)] = 0

    def __post_init__(self) -> None:
        """Checks the numbers.

        Raises:
            BadArgumentError: One is not finite, or out of bounds.
        """
        check_fields(self)

    def get_prior(self, kind: SignalKind) -> SignalPrior:
        """What is known of the signal; switched-off nuisances have no spread."""
        prior = self.signal_prior or _PRIORS[kind]
        return SignalPrior(
            prior.gain_sd if self.gains else 0.0,
            prior.load_friction if self.load_friction else 0.0,
            prior.load_friction_sd if self.load_friction else 0.0,
            prior.friction_sd if self.friction else 0.0,
        )


DEFAULT_SETTINGS = IdentificationSettings()
