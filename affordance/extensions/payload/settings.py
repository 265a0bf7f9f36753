"""Settings of the identification, with a source for each value.

If a value comes from a recording, docs/decisions/0020-recorded-data.md describes the recording and other evidence.
"""

import enum
from dataclasses import dataclass
from typing import Annotated

from affordance.files.constraints import SEEDS, Setting, Whole, Within, check_fields

NUM_SAMPLES = Whole(100, 1_000_000)
MIN_SPEED = Within(0.0, 10.0)  # [rad/s]
CUTOFF = Within(0.1, 1e3)  # [Hz]
_SHARE = Within(0.0, 10.0)
_RECORDED = "docs/decisions/0020-recorded-data.md"


class SignalKind(enum.Enum):
    """Kind of a run's signal, which determines the friction in it. Recordings do not state their kind."""

    JOINT_TORQUE = "joint_torque"  # link-side torque sensors: excludes gear friction
    MOTOR_TORQUE = "motor_torque"  # motor current times the maker's gain: includes gear friction
    CURRENT = "current"  # motor current: includes gear friction, and gains are unknown
    WRENCH = "wrench"  # force and torque of a sensor at the wrist

    @property
    def feels_gears(self) -> bool:
        """True if the signal contains gear friction and rotor inertia."""
        return self in (SignalKind.MOTOR_TORQUE, SignalKind.CURRENT)

    @property
    def unit(self) -> str:
        """Unit of the signal."""
        return {"current": "A", "wrench": "N, N m"}.get(self.value, "N m")


@dataclass(frozen=True)
class SignalPrior:
    """Prior of the gains and the friction for a kind of signal.

    Attributes:
        scale_common_sd: Relative standard deviation of a factor common to all gains, the same in every run, before
            any calibration.
        scale_own_sd: Relative standard deviation of the individual factor of each gain, the same in every run.
        drift_common_sd: Relative standard deviation of a factor common to all gains in one session. It also applies
            to gains calibrated in another session.
        drift_own_sd: Relative standard deviation of the individual factor of each gain in one session.
        change_common_sd: Relative standard deviation of a common change of all gains from one run of a session to the
            next.
        change_own_sd: Relative standard deviation of the individual change of each gain from run to run.
        load_friction: Prior mean of mu, friction as a fraction of the load.
        load_friction_sd: Standard deviation of mu before any calibration.
        friction_sd: Standard deviation of Coulomb friction, viscous friction (per rad/s) and offset, or of their
            change between two runs, in the signal's unit.
    """

    scale_common_sd: Annotated[
        float,
        _SHARE,
        Setting("1", "half of each sensor's own, an assumption; for currents unknown without a weighed load"),
    ]
    scale_own_sd: Annotated[
        float,
        _SHARE,
        Setting(
            "1", "KUKA states 2 % of full scale for an LBR iiwa's torque sensors; for wrist sensors an assumption"
        ),
    ]
    drift_common_sd: Annotated[
        float,
        _SHARE,
        Setting(
            "1",
            "neodymium magnets lose .1 % of their flux per kelvin, strain gauges change by .02 %, and joints warm up "
            "by 15 K in an hour of work",
        ),
    ]
    drift_own_sd: Annotated[float, _SHARE, Setting("1", "the same, for joints that differ by 5 K")]
    change_common_sd: Annotated[
        float, _SHARE, Setting("1", "the same, for joints that warm up by 4 K in minutes; sensors repeat to .2 %")
    ]
    change_own_sd: Annotated[float, _SHARE, Setting("1", "half of the common change with temperature, an assumption")]
    load_friction: Annotated[float, Setting("1", f"a UR10e's gears lose 3 to 10 % of the load ({_RECORDED})")]
    load_friction_sd: Annotated[
        float, Setting("1", "covers a UR10e's joints; servos lose a third of the load and need a prior of their own")
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
        floor: True to widen the posterior by model errors that do not average out.
        correlated_noise: True to estimate the correlation of neighbouring errors; False to assume independent errors.
        signal_prior: Prior of the signal; None for the prior of its kind.
        load_friction_drift: Standard deviation of the drift of mu from run to run, after calibration.
        friction_drift: Relative standard deviation of the drift of calibrated friction and offset.
        gain_common_sd: Relative standard deviation of a factor common to all gains estimated from the arm's file.
        gain_own_sd: Relative standard deviation of the individual factor of each of these gains.
        min_speed: Joint speed below which the direction of friction is uncertain and samples are left out, [rad/s].
        cutoff_factor: Cut-off of the low-pass filter as a multiple of the motion's bandwidth.
        cutoff: Cut-off of the low-pass filter, [Hz]; None to use ``cutoff_factor``.
        trim: Time that is cut off at either end, where filters ring, [s].
        block: Length of the blocks from which the correlation of errors is estimated, [s].
        max_rate: Rate to which faster runs are decimated after filtering, [Hz].
        repeat_tolerance: Largest difference of a joint angle between two runs of one motion, [rad].
        num_samples: Number of samples of the posterior; at most 4000 if annealing is needed.
        unseen_share: Standard deviation of the mass that a camera did not see, as a fraction of the total mass.
        seed: Seed of the samples.
    """

    floor: Annotated[bool, Setting("", f"the apparent load of an empty hand does not average out ({_RECORDED})")] = (
        True
    )
    correlated_noise: Annotated[
        bool, Setting("", f"with white noise 90 % intervals contain the truth in 12 % of the cases ({_RECORDED})")
    ] = True
    signal_prior: SignalPrior | None = None
    load_friction_drift: Annotated[float, _SHARE, Setting("1", "as for the gains")] = 0.02
    friction_drift: Annotated[float, _SHARE, Setting("1", "lubricants thin by some per cent per kelvin")] = 0.1
    gain_common_sd: Annotated[
        float,
        _SHARE,
        Setting(
            "1",
            "currents of an empty UR10e compared with torques from its URDF: gains of joints 1 to 3 differ by up to "
            f"50 % ({_RECORDED})",
        ),
    ] = 0.20
    gain_own_sd: Annotated[float, _SHARE, Setting("1", "the same recording")] = 0.12
    min_speed: Annotated[float, MIN_SPEED, Setting("rad/s", "the sign of a slower filtered velocity flickers")] = 0.03
    cutoff_factor: Annotated[
        float,
        Within(0.1, 1e3),
        Setting("1", "a fourth-order Butterworth filter is exact to 1e-5 at a quarter of its cut-off"),
    ] = 4.0
    cutoff: Annotated[float, CUTOFF, Setting("Hz", "derived from the motion unless given")] | None = None
    trim: Annotated[float, Within(0.0, 1e3), Setting("s", "filters ring")] = 1.0
    block: Annotated[float, Within(1e-3, 1e3), Setting("s", "errors are correlated over 0.3 to 1 s")] = 2.0
    max_rate: Annotated[float, Within(1.0, 1e5), Setting("Hz", "an assumption")] = 100.0
    repeat_tolerance: Annotated[float, Within(0.0, 10.0), Setting("rad", "an assumption")] = 0.02
    num_samples: Annotated[
        int, NUM_SAMPLES, Setting("1", "interval edges vary by less than a tenth of an SD between seeds")
    ] = 32_000
    unseen_share: Annotated[float, _SHARE, Setting("1", "an assumption")] = 0.2
    seed: Annotated[int, SEEDS] = 0

    def __post_init__(self) -> None:
        """Checks that all numbers are within bounds.

        Raises:
            BadArgumentError: A number is not finite or out of bounds.
        """
        check_fields(self)

    def get_prior(self, kind: SignalKind) -> SignalPrior:
        """Returns the prior of a kind of signal."""
        return self.signal_prior or PRIORS[kind]


DEFAULT_SETTINGS = IdentificationSettings()
