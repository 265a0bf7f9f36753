"""Sizes of errors in simulated recordings, each with its source.

The values were fixed before the error model of identification was changed. One value was corrected after results of
both models were known: gains of currents had differed by 1.5 % between the two runs of a pair, as after an hour of
warming up. This is now the drift between sessions, and the results of both models were computed again.
"""

from dataclasses import dataclass, replace
from pathlib import Path

from affordance.extensions.payload.settings import SignalKind

_HERE = Path(__file__).parent


@dataclass(frozen=True)
class ArmErrors:
    """Sizes of one arm's errors, usually standard deviations.

    Tuples contain one value per joint.
    """

    robot: Path  # robot's file
    tip: str  # link that carries the payload
    kind: SignalKind
    home: tuple[float, ...]  # centre of all motions, [rad]
    signal_per_torque: tuple[float, ...]  # mean signal per newton metre
    coulomb: tuple[float, ...]  # friction at low speed, [N m]
    viscous: tuple[float, ...]  # friction per speed, [N m s/rad]
    rotor_inertia: tuple[float, ...]  # reflected rotor inertia, missing in the file, [kg m^2]
    load_friction: tuple[float, float]  # smallest and largest fraction of the load lost to friction
    scale_common: float  # relative error of all gains, the same in every run
    scale_own: float  # relative error of each gain, the same in every run
    drift_common: float  # relative error of all gains in one session
    drift_own: float  # relative error of each gain in one session
    change_common: float  # relative change of all gains from run to run of a session
    change_own: float  # relative change of each gain from run to run of a session
    offset: float  # offset of the signal in one run, [N m]
    noise: tuple[float, ...]  # SD of correlated errors, [N m]
    agreement: tuple[float, float]  # smallest and largest time constant of these errors, [s]
    masses: tuple[float, float]  # smallest and largest mass of a load, [kg]


# Stribeck effect: friction increases towards zero speed by this fraction of Coulomb friction, over this range of
# speed, [rad/s]. Bittencourt and Gunnarsson (Static friction in a robot joint, J. Dyn. Sys. Meas. Control 134, 2012)
# report such an increase for an ABB arm; the numbers are assumptions.
STRIBECK_SHARE, STRIBECK_SPEED = 0.25, 0.1
# Relative change of a joint's friction from run to run. Lubricants thin by a few per cent per kelvin, and the
# friction of robot joints halves from cold to warm (Bittencourt and Gunnarsson 2012; Simoni et al., Modelling the
# temperature in joint friction of industrial manipulators, Robotica 2019). The value assumes two kelvin between runs
# of one session.
FRICTION_CHANGE = 0.08
# Relative errors of each link in a robot's file: of its mass, and of its centre of mass as a fraction of 20 cm. These
# are assumptions; identified Pandas differ from each other by as much (Gaz et al., IEEE RA-L 4(4), 2019, compared
# with the maker's later file).
LINK_ERROR, LINK_LENGTH = 0.05, 0.2
# Weight of a cable in half of the loaded runs, [kg], and its horizontal pull as a fraction of that weight: 30 cm of a
# sensor cable with 60 g per metre, hanging from one of the last links. Both are assumptions.
CABLE_MASS, CABLE_PULL, CABLE_SHARE = 0.020, 1.0, 0.5
# Noise of encoders, noise of the controller's velocities, and white noise of the signal as a fraction of its
# correlated noise.
ANGLE_NOISE, SPEED_NOISE, WHITE_SHARE = 1e-5, 1e-3, 1.0
# Relative error of a kitchen scale.
SCALE_ERROR = 1e-3
# Probability that both runs of a load have the same motion; bounds of the duration of a run, [s], and of the RMS
# speed of a joint, [rad/s], both drawn log-uniformly.
PAIRED, LENGTHS, SPEEDS = 0.5, (8.0, 50.0), (0.15, 1.0)

# Torque sensors of a Panda. Friction and offsets on the link side: half of the amplitudes of Gaz et al. 2019, and
# values from its published recording (docs/decisions/0020-recorded-data.md). Scale: KUKA states that torque sensors
# of the LBR iiwa are accurate to 2 % of full scale, all of which may be gain errors. Drift: strain gauges change
# their gain by about .02 % per kelvin, over 15 K; from run to run they repeat to .2 %, an assumption. Load friction:
# roller bearings, for which makers' catalogues state .001 to .005, and seals. Noise: residuals of an arm fitted to
# the published recording, which are correlated over .7 to 2.4 s, twice the time constant.
PANDA = ArmErrors(
    robot=_HERE / "panda.urdf",
    tip="panda_link8",
    kind=SignalKind.JOINT_TORQUE,
    home=(0.0, -0.3, 0.0, -1.9, 0.0, 1.9, 0.8),
    signal_per_torque=(1.0,) * 7,
    coulomb=(0.27, 0.44, 0.32, 0.64, 0.42, 0.15, 0.28),
    viscous=(0.1, 0.1, 0.1, 0.1, 0.05, 0.05, 0.05),
    rotor_inertia=(0.0,) * 7,
    load_friction=(0.0, 0.01),
    scale_common=0.01,
    scale_own=0.02,
    drift_common=0.003,
    drift_own=0.003,
    change_common=0.002,
    change_own=0.002,
    offset=0.1,
    noise=(0.15, 0.22, 0.08, 0.13, 0.08, 0.06, 0.04),
    agreement=(0.2, 0.8),
    masses=(0.1, 3.0),
)
# Motor currents of an arm like a UR10e. Gains, load friction, friction and residuals of a pair: from a published
# recording (docs/decisions/0020-recorded-data.md). Drift: neodymium magnets lose .09 to .12 % of their flux per
# kelvin (makers' data sheets); joints warm by 15 K in the first hour of work and by 4 K in the minutes between two
# runs, and differ by 5 K from each other. Rotor inertia: fitting each joint of that recording's empty run
# with own weight, friction and acceleration gives 5.5 and 7.5 at the two largest joints, which have the same motor,
# 1.8 at the elbow and .44 to .60 at the wrist. Fitting all joints together gives 7.4, 6.2, 1.8 and .45.
UR_LIKE = ArmErrors(
    robot=_HERE / "ur_like.urdf",
    tip="tool0",
    kind=SignalKind.CURRENT,
    home=(0.0, -1.3, 1.4, -1.5, -1.4, 0.0),
    signal_per_torque=(0.073, 0.082, 0.099, 0.096, 0.099, 0.097),
    coulomb=(15.0, 12.0, 6.0, 2.5, 2.5, 2.0),
    viscous=(20.0, 12.0, 6.0, 2.0, 2.0, 2.0),
    rotor_inertia=(5.5, 5.5, 1.8, 0.45, 0.45, 0.45),
    load_friction=(0.03, 0.10),
    scale_common=0.0,
    scale_own=0.0,
    drift_common=0.015,
    drift_own=0.005,
    change_common=0.004,
    change_own=0.002,
    offset=0.2,
    noise=(0.5, 0.45, 0.35, 0.15, 0.15, 0.12),
    agreement=(0.15, 0.5),
    masses=(0.2, 6.0),
)


def _scale(errors: ArmErrors, factor: float) -> ArmErrors:
    """Multiplies the offset and the noise of a signal."""
    return replace(errors, offset=factor * errors.offset, noise=tuple(factor * each for each in errors.noise))


ARMS = {"panda": PANDA, "ur": UR_LIKE, "ur_half": _scale(UR_LIKE, 0.5), "ur_twice": _scale(UR_LIKE, 2.0)}
