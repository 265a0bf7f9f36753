"""Identifies a payload from recorded joint motion and signals."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from affordance.arguments import check_kind, check_number
from affordance.arrays import Array
from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.exceptions import BadValueError
from affordance.extensions.payload.contradictions import find_contradictions
from affordance.extensions.payload.doubts import check_sensors, find_doubts, weigh_arm
from affordance.extensions.payload.evidence.evidence import Evidence
from affordance.extensions.payload.evidence.gains import Gains, arrange_gains, build_nominal_gains
from affordance.extensions.payload.evidence.paired_runs import build_paired_evidence
from affordance.extensions.payload.evidence.unpaired_runs import build_file_evidence, build_unpaired_evidence
from affordance.extensions.payload.evidence.wrist_sensor import build_wrist_evidence, express_in_sensor
from affordance.extensions.payload.excitation.more_motion import suggest_motion, suggest_posture, suggest_run
from affordance.extensions.payload.posterior.calibration import (
    SCALE_SD,
    calibrate_gains,
    check_halves,
    estimate_gains,
)
from affordance.extensions.payload.posterior.inference import infer
from affordance.extensions.payload.posterior.part_posterior import SeenObject
from affordance.extensions.payload.posterior.payload_belief import PayloadBelief
from affordance.extensions.payload.posterior.solid_prior import SolidPrior
from affordance.extensions.payload.recording.joint_rates import ANGLE_SLACK
from affordance.extensions.payload.recording.preparation import prepare
from affordance.extensions.payload.recording.run import POSTURE_STEP, WRENCH_COLUMNS, Run
from affordance.extensions.payload.settings import DEFAULT_SETTINGS, IdentificationSettings, SignalKind
from affordance.objects.tool import Tool, find_box
from affordance.plant.serial_chain import ArmOwner, SerialChain
from affordance.vision.eye import measure_features
from affordance.vision.features import VisionError
from affordance.vision.prediction import predict_object

# Builds the evidence about a load from the arm, the loaded run, empty runs, and prior gains.
type _Analysis = Callable[[SerialChain, Run, Sequence[Run], Gains, IdentificationSettings], Evidence]
# Bounds of a reference mass, [kg].
_MASSES = (1e-3, 1e3)
_EARTH = 9.81  # [m/s^2]
_OVERLAP = 0.2  # share of common samples above which two runs count as the same recording


class Runs(NamedTuple):
    """Recordings of one arm.

    Attributes:
        loaded: Run with the load in the hand.
        empty: Runs with an empty hand: the same motion once (paired), any motions (unpaired), or an empty tuple.

    Example:
        >>> from affordance import MODELS, Runs, read_run
        >>> loaded, empty = (read_run(MODELS / "demo" / f"{name}.csv") for name in ("bar_of_oak", "empty"))
        >>> len(Runs(loaded, (empty,)).empty)
        1
    """

    loaded: Run
    empty: tuple[Run, ...] = ()


def identify(
    arm: SerialChain | ArmOwner,
    runs: Runs,
    *,
    paired: bool = True,
    gains: Gains | None = None,
    reference_mass: float | None = None,
    seen: SeenObject | None = None,
    solid_prior: SolidPrior | None = None,
    deviation: float = 0.06,
    settings: IdentificationSettings = DEFAULT_SETTINGS,
) -> PayloadBelief:
    """Identifies a payload from recorded runs.

    Args:
        arm: Serial chain from ``load_robot`` up to the link that carries the payload, or a ``Robot``.
        runs: Recordings. Joints are matched by name.
        paired: True if the loaded run repeats the motion of the empty run; ignored without an empty run.
        gains: Gains calibrated earlier with a weighed load; None to estimate them from these runs.
        reference_mass: Weighed mass of the load, [kg], which calibrates currents and checks other signals; None to
            use the mass in the loaded run's description, if any.
        seen: Prediction for the object from a camera and a material memory; None without a camera.
        solid_prior: Prior of an unseen body; None for a broad prior over solids that a hand can hold.
        deviation: Standard deviation of an object's density about its material's mean, as a fraction of the mean.
        settings: Settings of nuisance parameters, filters and sampling.

    Returns: The posterior of the payload, with any reasons not to trust it.

    Raises:
        BadArgumentError: An argument has the wrong type or is out of bounds.
        BadValueError: A run does not fit the arm, or paired runs have different motions.
    """
    if not isinstance(arm, SerialChain):
        hint = "load_robot(PATH, TIP) returns one, Robot.load(FOLDER) contains one"
        arm = arm.chain if isinstance(arm, ArmOwner) else check_kind("arm", arm, SerialChain, hint)
    _check_arguments(runs, gains, seen, settings)
    check_number("deviation", deviation, 0.0, 1.0)
    loaded, *empty = (express_in_sensor(arm, run.arrange(arm.joint_names)) for run in (runs.loaded, *runs.empty))
    _check_kinds(loaded, empty)
    for run in (*empty, loaded):
        check_run(arm, run)
    if loaded.description.postures:  # postures are not filtered, and their errors are independent
        settings = replace(settings, block=POSTURE_STEP, trim=0.0, min_speed=0.0)
    first = (*empty, loaded)[0]
    contradictions = [f"{first.source}: {each}" for each in find_contradictions(arm, first, settings)]
    description = loaded.description
    arm = arm.with_gravity(description.gravity)
    if reference_mass is None:
        reference_mass = description.reference_mass
    if reference_mass is not None:
        check_reference_mass("reference_mass", reference_mass)
    is_calibration = gains is None and reference_mass is not None and description.kind is SignalKind.CURRENT
    if is_calibration and paired and empty:
        # A weighed load calibrates the gains from the difference of two runs, which needs no gains in advance.
        before = build_nominal_gains(arm.joint_names, description.kind, settings)
    else:
        before = find_gains(arm, loaded, empty, gains, settings)
    try:
        evidence = _choose_analysis(loaded, empty, paired)(arm, loaded, empty, before, settings)
        solid = SolidPrior.for_hand() if solid_prior is None else solid_prior
        calibration = None
        if is_calibration and reference_mass is not None:
            calibration = replace(calibrate_gains(evidence, reference_mass, settings), robot=arm.fingerprint)
            if empty and not empty[0].description.compensates_arm:
                calibration = replace(calibration, own_weight=weigh_arm(arm, empty[0], calibration, settings))
            before = calibration
            solid = solid.with_mass(reference_mass, SCALE_SD * reference_mass)
        belief = infer(
            evidence,
            before,
            solid=solid,
            placed=None if seen is None else seen.place(description.object_pose),
            deviation=deviation,
            settings=settings,
        )
        assumed = (
            *belief.assumptions,
            *_assume_of_hand(arm, before, calibration is not None, seen is not None, bool(empty)),
        )
        belief = replace(belief, calibration=calibration, reference_mass=reference_mass, assumptions=assumed)
        if calibration is not None and reference_mass is not None:
            belief = replace(belief, halves=check_halves(evidence, reference_mass, settings))
        suggest = suggest_posture if description.postures else suggest_motion
        of_runs = [f"{run.source}: {note}" for run in (*empty, loaded) for note in run.notes]
        belief = replace(belief, notes=(*of_runs, *belief.notes, *suggest(arm, belief, before, settings)))
        doubts = (*contradictions, *find_doubts(arm, loaded, empty, belief, before, settings))
        return replace(belief, doubts=doubts, advice=suggest_run(belief), tip=arm.tip)
    except np.linalg.LinAlgError as error:
        problem = f"gives equations without a solution ({error}): do signals, times and robot belong to the same arm?"
        raise BadValueError(loaded.source, "", problem) from error


def see_tool(tool: Tool, memory: MaterialMemory, prior: Prior, scale_sd: float = 0.0) -> SeenObject:
    """Predicts mass and inertia of a seen tool from a material memory and a prior for unknown materials.

    The size of each part has a relative error with standard deviation ``scale_sd``, equal in all directions.
    """
    features = tuple(
        replace(part, deformations=_scale(part.X_TE[:3, 3], scale_sd))
        for part in measure_features(tool, VisionError(), np.random.default_rng(0))
    )
    return SeenObject(predict_object(features, memory, prior), features, *find_box(tool.components))


def _scale(centre: Array, sd: float) -> Array:
    """Computes the deformation of a part that grows about its centre by one SD, shape (G, 4, 4)."""
    growth = np.zeros((1, 4, 4))
    growth[0, :3, :3] = sd * np.eye(3)
    growth[0, :3, 3] = -sd * centre
    return growth[: int(sd > 0.0)]


def check_reference_mass(name: str, mass: float) -> None:
    """Checks that a weighed mass is within bounds, [kg].

    Raises:
        BadArgumentError: The mass is out of bounds.
    """
    check_number(name, mass, *_MASSES, "kg")


def _check_arguments(
    runs: Runs, gains: Gains | None, seen: SeenObject | None, settings: IdentificationSettings
) -> None:
    check_kind("runs", runs, Runs, "Runs(loaded, (empty,)) builds one")
    check_kind("runs.loaded", runs.loaded, Run, "read_run(PATH) reads one")
    for i, run in enumerate(check_kind("runs.empty", runs.empty, Sequence, "a tuple of runs, or ()")):
        check_kind(f"runs.empty[{i}]", run, Run, "read_run(PATH) reads one")
    if gains is not None:
        check_kind("gains", gains, Gains, "read_gains(PATH) reads them")
    if seen is not None:
        check_kind("seen", seen, SeenObject)
    check_kind("settings", settings, IdentificationSettings)


def _assume_of_hand(
    arm: SerialChain, gains: Gains, is_weighed: bool, is_seen: bool, has_empty: bool
) -> Iterator[str]:
    """Lists assumptions that no recording can check, one sentence each."""
    others = ""  # without an empty run, the analysis itself states what counts as load
    if has_empty:
        others = (
            ", and whatever was attached there in the empty runs still is: a gripper missing from them counts as"
            " payload"
        )
    elif gains.kind is not SignalKind.WRENCH:
        others = ": a gripper missing from the file counts as payload"
    yield f"the payload is attached at {arm.tip}, which is where the robot's file says{others}"
    yield f"the recorded arm is the one in {arm.source}: the file of a similar arm would give another mass"
    if gains.kind is SignalKind.WRENCH:
        yield "the sensor's unit and mounting are as described: no recording can reveal a wrong scale"
    else:
        yield (
            f"nothing but the load pulls at the arm: a pull of 1 N at the tip, by a cable or a hand, counts as "
            f"{1e3 / _EARTH:.0f} g, and no recording can reveal it"
        )
        yield (
            "the controller subtracted no payload from the signal in any run, unless the description says so: a "
            "payload that was set in one run only is missing from the result, or added to it"
        )
    if is_weighed or (gains.kind is SignalKind.CURRENT and not gains.is_by_weight):
        yield "the scale is accurate: every mass identified with these gains has its relative error"
    if is_seen:
        yield "the held object is the one that was named, with the stated pose in the hand and accuracy of its sizes"


def check_run(arm: SerialChain, run: Run) -> None:
    """Checks that an arm can follow a run, and that its sensors work.

    Raises:
        BadValueError: A joint turns too fast or exceeds its limits, or a sensor signal is constant.
    """
    run.check_rates(arm.velocity_limits, arm.limits, arm.source)
    _check_angles(arm, run)
    check_sensors(run)


def _check_angles(arm: SerialChain, run: Run) -> None:
    """Checks that the joint angles of a run are within the arm's limits."""
    low, high = arm.limits
    beyond = np.maximum(low - run.q, run.q - high) - ANGLE_SLACK
    row, joint = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
    if beyond[row, joint] > 0.0:
        bound = f"must be from {low[joint]:.4g} to {high[joint]:.4g} rad according to {arm.source}"
        turned = run.q[:, joint] - np.copysign(2.0 * np.pi, run.q[row, joint])
        is_turn = ((turned >= low[joint] - ANGLE_SLACK) & (turned <= high[joint] + ANGLE_SLACK)).all()
        hint = "is it off by a turn (2 pi)?" if is_turn else "are these degrees, other joints or another robot?"
        raise run.error_at(int(row), f"q of {arm.joint_names[joint]}", f"is {run.q[row, joint]:.4g}, {bound}; {hint}")


def _choose_analysis(loaded: Run, empty: Sequence[Run], paired: bool) -> _Analysis:
    if loaded.description.kind is SignalKind.WRENCH:
        return build_wrist_evidence
    if not empty:
        return build_file_evidence
    return build_paired_evidence if paired else build_unpaired_evidence


def find_gains(
    arm: SerialChain, loaded: Run, empty: Sequence[Run], gains: Gains | None, settings: IdentificationSettings
) -> Gains:
    """Determines the prior gains of the loaded run: given, nominal, or estimated from the arm's own weight."""
    run = (*empty, loaded)[0]
    kind = run.description.kind
    names = WRENCH_COLUMNS if kind is SignalKind.WRENCH else arm.joint_names
    if gains is not None:
        if gains.kind is not kind:
            raise BadValueError(run.source, "signal", f"is {kind.value}, must be {gains.kind.value} as for the gains")
        return arrange_gains(gains, names, "the gains").with_drift(settings)
    if kind is not SignalKind.CURRENT:
        return build_nominal_gains(names, kind, settings)
    own = estimate_gains(arm, run, prepare(run, settings), settings)
    if empty:
        return own
    # The load contributes to the signals, so gains estimated from them would be too large.
    source = (
        f"assumed to be alike, each uncertain by 50 % and all by {100 * own.common_sd:g} % in common, "
        f"by the weight in {arm.source}; a weighed load would give 2 %"
    )
    return replace(own.widen(), source=source)


def _check_kinds(loaded: Run, empty: Sequence[Run]) -> None:
    other = loaded.description
    for run in empty:
        one = run.description
        pairs = {
            "signal": (one.kind.value, other.kind.value),
            "gravity": (one.gravity, other.gravity),
            "postures": (one.postures, other.postures),
        }
        for name, (given, needed) in pairs.items():
            if given != needed:
                raise BadValueError(run.source, name, f"is {given}, must be {needed} as in the loaded run")
        share = loaded.measure_overlap(run) if run.signal.shape[1] == loaded.signal.shape[1] else 0.0
        if share > _OVERLAP:
            problem = f"contains {100.0 * share:.0f} % of the samples of {loaded.source}, must be another recording"
            raise BadValueError(run.source, "", problem)
