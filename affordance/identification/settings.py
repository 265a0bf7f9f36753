"""Settings of identification, each number with its source; every nuisance can be switched off.

For numbers found on a recording, docs/decisions/0020-recorded-data.md names the recording and other observations.
"""

import enum
from dataclasses import dataclass, replace
from typing import Annotated

from affordance.files.constraints import SEEDS, Setting, Whole, Within, check_fields

NUM_SAMPLES = Whole(100, 1_000_000)
MIN_SPEED = Within(0.0, 10.0)  # [rad/s]
_SHARE = Within(0.0, 10.0)
_RECORDED = "docs/decisions/0020-recorded-data.md"


# Standard deviations of gains in the prior of a signal.
_OF_GAINS = (
    "scale_common_sd",
    "scale_own_sd",
    "drift_common_sd",
    "drift_own_sd",
    "change_common_sd",
    "change_own_sd",
)


class SignalKind(enum.Enum):
    """Kind of a run's signal, which determines the friction in it and is not stated by a file of efforts."""

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
    """Prior of a kind of signal before a run.

    Attributes:
        scale_common_sd: Relative standard deviation of a factor that all gains share in every run, before any
            calibration.
        scale_own_sd: Relative standard deviation of each gain in addition, in every run.
        drift_common_sd: Relative standard deviation of a factor that all gains share in one session, calibrated
            in another or not.
        drift_own_sd: Relative standard deviation of each gain in one session in addition.
        change_common_sd: Relative standard deviation of a factor by which all gains change from one run of a session
            to the next.
        change_own_sd: Relative standard deviation of the change of each gain in addition.
        load_friction: Mean of mu, friction as a fraction of the load.
        load_friction_sd: Standard deviation of mu before any calibration.
        friction_sd: Standard deviation of Coulomb friction, viscous friction (per rad/s) and offset, or of their
            change between two runs, in the signal's unit.
    """

    scale_common_sd: Annotated[
        float,
        _SHARE,
        Setting("1", "half of each sensor's own, an assumption; unknown of currents until a weighed load"),
    ]
    scale_own_sd: Annotated[
        float,
        _SHARE,
        Setting(
            "1", "KUKA states 2 % of full scale of the torque sensors of an LBR iiwa; wrist sensors, an assumption"
        ),
    ]
    drift_common_sd: Annotated[
        float,
        _SHARE,
        Setting(
            "1",
            "magnets of neodymium lose .1 % of their flux a kelvin, strain gauges change by .02 %, and joints warm "
            "by 15 K in an hour of work",
        ),
    ]
    drift_own_sd: Annotated[float, _SHARE, Setting("1", "the same, as joints differ by 5 K in temperature")]
    change_common_sd: Annotated[
        float, _SHARE, Setting("1", "the same, as joints warm by some 4 K in minutes; sensors repeat to .2 %")
    ]
    change_own_sd: Annotated[float, _SHARE, Setting("1", "half of that by temperature, an assumption")]
    load_friction: Annotated[float, Setting("1", f"a UR10e's gears lose 3 to 10 % of the load ({_RECORDED})")]
    load_friction_sd: Annotated[
        float, Setting("1", "covers a UR10e's joints; servos lose a third of the load and need their own")
    ]
    friction_sd: Annotated[
        float,
        Setting(
            "unit of the signal",
            "friction of a UR10e may change by some tenths of an ampere from run to run, 3 N m at 10 N m/A; the "
            "offset of a wrist sensor drifts by some newtons with temperature",
        ),
    ]


PRIORS = {
    SignalKind.JOINT_TORQUE: SignalPrior(0.01, 0.02, 0.003, 0.003, 0.002, 0.002, 0.0, 0.0, 0.3),
    SignalKind.MOTOR_TORQUE: SignalPrior(0.01, 0.02, 0.015, 0.005, 0.004, 0.002, 0.05, 0.07, 3.0),
    SignalKind.CURRENT: SignalPrior(0.0, 0.0, 0.015, 0.005, 0.004, 0.002, 0.05, 0.07, 0.3),
    SignalKind.WRENCH: SignalPrior(0.005, 0.01, 0.003, 0.003, 0.002, 0.002, 0.0, 0.0, 3.0),
}


@dataclass(frozen=True)
class IdentificationSettings:
    """Settings of one identification.

    Attributes:
        gains: True if gains are uncertain.
        load_friction: True if friction grows with the load.
        friction: True if friction and offsets are modelled.
        tare: True if the apparent payload of an empty hand is subtracted (wrist sensor).
        floor: True if the error of the arm's model that does not average out is added.
        correlated_noise: True if the correlation of neighbouring errors is estimated; False for independent errors.
        signal_prior: Prior of the signal; None for that of its kind.
        load_friction_drift: Standard deviation of mu's drift from run to run, once calibrated.
        friction_drift: Relative standard deviation of the drift of calibrated friction and offset.
        gain_common_sd: Relative standard deviation of a factor common to all gains estimated from the arm's file.
        gain_own_sd: Relative standard deviation of each of these gains in addition to that factor.
        min_speed: Speed below which friction has no sure direction and samples of a joint are left out, [rad/s].
        cutoff_factor: Cut-off of the low-pass filter as a multiple of the motion's bandwidth.
        trim: Time left out at either end, where filters ring, [s].
        block: Length of the blocks that measure the correlation of errors, [s].
        max_rate: Rate to which faster runs are decimated after filtering, [Hz].
        repeat_tolerance: Largest difference of a joint angle between two runs of one motion, [rad].
        num_samples: Number of samples of the posterior; at most 4000 where they are annealed.
        unseen_share: Standard deviation of the mass that a camera did not see, as a fraction of the whole.
        seed: Seed of the samples.
    """

    gains: Annotated[bool, Setting("", f"gains drift between runs ({_RECORDED})")] = True
    load_friction: Annotated[bool, Setting("", f"gears lose a share of the load ({_RECORDED})")] = True
    friction: Annotated[bool, Setting("", f"friction changes between runs ({_RECORDED})")] = True
    tare: Annotated[bool, Setting("", "an empty hand holds nothing (docs/identify.md)")] = True
    floor: Annotated[bool, Setting("", f"what an empty hand seems to hold does not average out ({_RECORDED})")] = True
    correlated_noise: Annotated[
        bool, Setting("", f"with white noise 90 % intervals hold in 12 % of the cases ({_RECORDED})")
    ] = True
    signal_prior: SignalPrior | None = None
    load_friction_drift: Annotated[float, _SHARE, Setting("1", "as the gains'")] = 0.02
    friction_drift: Annotated[float, _SHARE, Setting("1", "lubricants thin by some per cent a kelvin")] = 0.1
    gain_common_sd: Annotated[
        float,
        _SHARE,
        Setting(
            "1",
            "currents of an empty UR10e against the torques of its URDF: gains of joints 1 to 3 are off by up to "
            f"50 % ({_RECORDED})",
        ),
    ] = 0.20
    gain_own_sd: Annotated[float, _SHARE, Setting("1", "the same recording")] = 0.12
    min_speed: Annotated[float, MIN_SPEED, Setting("rad/s", "below it the sign of a filtered velocity flickers")] = (
        0.03
    )
    cutoff_factor: Annotated[
        float, Within(0.1, 1e3), Setting("1", "a fourth-order Butterworth passes a quarter of its cut-off to 1e-5")
    ] = 4.0
    trim: Annotated[float, Within(0.0, 1e3), Setting("s", "filters ring")] = 1.0
    block: Annotated[float, Within(1e-3, 1e3), Setting("s", "errors are correlated over 0.3 to 1 s")] = 2.0
    max_rate: Annotated[float, Within(1.0, 1e5), Setting("Hz", "an assumption")] = 100.0
    repeat_tolerance: Annotated[float, Within(0.0, 10.0), Setting("rad", "an assumption")] = 0.02
    num_samples: Annotated[
        int, NUM_SAMPLES, Setting("1", "edges of intervals move by less than a tenth of an SD with the seed")
    ] = 32_000
    unseen_share: Annotated[float, _SHARE, Setting("1", "an assumption")] = 0.2
    seed: Annotated[int, SEEDS] = 0

    def __post_init__(self) -> None:
        """Raises a BadArgumentError for a number that is not finite or out of bounds."""
        check_fields(self)

    def get_prior(self, kind: SignalKind) -> SignalPrior:
        """Returns the prior of a kind of signal, with zeros for nuisances that are switched off."""
        prior = self.signal_prior or PRIORS[kind]
        return replace(
            prior,
            **({} if self.gains else dict.fromkeys(_OF_GAINS, 0.0)),
            load_friction=prior.load_friction if self.load_friction else 0.0,
            load_friction_sd=prior.load_friction_sd if self.load_friction else 0.0,
            friction_sd=prior.friction_sd if self.friction else 0.0,
        )


DEFAULT_SETTINGS = IdentificationSettings()
