"""Identification of a held payload from recorded q, v, vdot and tau."""

from collections.abc import Sequence
from typing import NamedTuple

from affordance.arguments import check_kind, check_number
from affordance.exceptions import BadValueError
from affordance.identification.calibration import calibrate_gains
from affordance.identification.evidence import Evidence
from affordance.identification.file_arm import build_file_evidence, estimate_gains
from affordance.identification.gains import Gains, arrange_gains, build_nominal_gains
from affordance.identification.inference import Identification, infer
from affordance.identification.joint_samples import restore_compensated
from affordance.identification.paired_runs import pair_runs
from affordance.identification.part_posterior import SeenObject
from affordance.identification.payload_belief import PayloadBelief
from affordance.identification.preparation import find_cutoff, prepare
from affordance.identification.robot_chain import RobotChain
from affordance.identification.run import Run
from affordance.identification.settings import DEFAULT_SETTINGS, IdentificationSettings, SignalKind
from affordance.identification.solid_prior import SolidPrior
from affordance.identification.unpaired_runs import build_unpaired_evidence, fit_empty_arm
from affordance.identification.wrist_sensor import build_wrist_evidence, build_wrist_gains

# Bounds of a reference mass, [kg], and largest spread of densities within a material, [kg/m^3].
_MASSES = (1e-3, 1e3)
_DEVIATION_MAX = 1e6


class Runs(NamedTuple):
    """Recordings of one arm.

    Attributes:
        loaded: Run with the load in the hand.
        empty: Runs with an empty hand: the same motion once (paired), any motions (unpaired), or an empty tuple.
    """

    loaded: Run
    empty: tuple[Run, ...] = ()


def identify(
    arm: RobotChain,
    runs: Runs,
    *,
    paired: bool = True,
    gains: Gains | None = None,
    reference_mass: float | None = None,
    seen: SeenObject | None = None,
    solid_prior: SolidPrior | None = None,
    deviation_sd: float = 100.0,
    settings: IdentificationSettings = DEFAULT_SETTINGS,
) -> PayloadBelief:
    """Identifies a payload from recorded runs.

    Args:
        arm: Robot up to the tip that carries the payload.
        runs: Recordings, whose joints are matched by name.
        paired: True if the loaded run repeats the empty one; ignored without an empty run.
        gains: Gains found before with a weighed load; None to find them here.
        reference_mass: Mass of the load by a scale, [kg], which calibrates currents and checks other signals; None
            for that of the loaded run's description.
        seen: Belief about the object by a camera and a memory of materials; None without a camera.
        solid_prior: Prior of a body that no camera has seen; None for any solid that a hand could hold.
        deviation_sd: Standard deviation of an object's density about its material's mean, [kg/m^3].
        settings: Settings of nuisances, filters and samples.

    Returns: The posterior of the payload.

    Raises:
        BadArgumentError: An argument is of the wrong kind or out of bounds.
        BadValueError: A run does not fit the arm, or does not repeat the other.
    """
    return identify_in_detail(
        arm,
        runs,
        paired=paired,
        gains=gains,
        reference_mass=reference_mass,
        seen=seen,
        solid_prior=solid_prior,
        deviation_sd=deviation_sd,
        settings=settings,
    ).belief


def identify_in_detail(
    arm: RobotChain,
    runs: Runs,
    *,
    paired: bool = True,
    gains: Gains | None = None,
    reference_mass: float | None = None,
    seen: SeenObject | None = None,
    solid_prior: SolidPrior | None = None,
    deviation_sd: float = 100.0,
    settings: IdentificationSettings = DEFAULT_SETTINGS,
) -> Identification:
    """Identifies a payload like ``identify``, and returns the fit as well."""
    _check_arguments(arm, runs, gains, seen, settings)
    check_number("deviation_sd", deviation_sd, 0.0, _DEVIATION_MAX, "kg/m^3")
    loaded = runs.loaded.arrange(arm.joint_names)
    empty = [run.arrange(arm.joint_names) for run in runs.empty]
    _check_kinds(loaded, empty)
    arm = arm.with_gravity(loaded.description.gravity)
    if reference_mass is None:
        reference_mass = loaded.description.reference_mass
    if reference_mass is not None:
        check_reference_mass("reference_mass", reference_mass)
    evidence, before = _build_evidence(arm, loaded, empty, paired, gains, reference_mass, settings)
    calibration = None
    if gains is None and reference_mass is not None and loaded.description.kind is SignalKind.CURRENT:
        calibration = before = calibrate_gains(evidence, reference_mass, settings)
    return infer(
        evidence,
        before,
        calibration=calibration,
        reference_mass=reference_mass,
        seen=seen,
        X_GT=loaded.description.object_pose,
        solid_prior=solid_prior,
        deviation_sd=deviation_sd,
        settings=settings,
    )


def check_reference_mass(name: str, mass: float) -> None:
    """Checks the given mass of a load, [kg].

    Raises:
        BadArgumentError: The mass is out of bounds.
    """
    check_number(name, mass, *_MASSES, "kg")


def _check_arguments(
    arm: RobotChain, runs: Runs, gains: Gains | None, seen: SeenObject | None, settings: IdentificationSettings
) -> None:
    check_kind("arm", arm, RobotChain, "load_robot(PATH, TIP) reads one")
    check_kind("runs", runs, Runs, "Runs(loaded, (empty,)) makes one")
    check_kind("runs.loaded", runs.loaded, Run, "read_run(PATH) reads one")
    for i, run in enumerate(check_kind("runs.empty", runs.empty, Sequence, "a tuple of runs, or ()")):
        check_kind(f"runs.empty[{i}]", run, Run, "read_run(PATH) reads one")
    if gains is not None:
        check_kind("gains", gains, Gains, "read_gains(PATH) reads them")
    if seen is not None:
        check_kind("seen", seen, SeenObject)
    check_kind("settings", settings, IdentificationSettings)


def _build_evidence(
    arm: RobotChain,
    loaded: Run,
    empty: Sequence[Run],
    paired: bool,
    gains: Gains | None,
    reference_mass: float | None,
    settings: IdentificationSettings,
) -> tuple[Evidence, Gains]:
    """Builds the evidence, and the gains as known before the loaded run."""
    kind = loaded.description.kind
    if kind is SignalKind.WRENCH:
        cutoff = max(find_cutoff(run, settings) for run in (loaded, *empty))
        without = prepare(empty[0], settings, cutoff=cutoff) if empty else None
        with_load = prepare(loaded, settings, cutoff=cutoff)
        return build_wrist_evidence(arm, loaded, with_load, without, settings), build_wrist_gains(settings)
    if empty and paired:
        if len(empty) > 1:
            raise BadValueError("--empty", "", f"names {len(empty)} runs, must name one for a paired analysis")
        evidence = pair_runs(arm, empty[0], loaded, settings)
        return evidence, _find_gains(arm, empty[0], gains, reference_mass, settings)
    before = _find_gains(arm, (*empty, loaded)[0], gains, None, settings)
    cutoff = max(find_cutoff(run, settings) for run in (loaded, *empty))
    with_load = prepare(loaded, settings, cutoff=cutoff)
    if not empty:
        return build_file_evidence(arm, loaded, with_load, before, settings), before
    prepared = [prepare(run, settings, cutoff=cutoff) for run in empty]
    signals = [
        restore_compensated(arm, run, part, before.mean[:, 0]) for run, part in zip(empty, prepared, strict=True)
    ]
    fitted = fit_empty_arm(arm, prepared, signals, before, settings)
    return build_unpaired_evidence(arm, fitted, loaded, with_load, settings), before


def _find_gains(
    arm: RobotChain, run: Run, gains: Gains | None, reference_mass: float | None, settings: IdentificationSettings
) -> Gains:
    """Returns the gains as known before the loaded run."""
    kind = run.description.kind
    if gains is not None:
        if gains.kind is not kind:
            raise BadValueError(run.source, "signal", f"is {kind.value}, must be {gains.kind.value} as the gains' is")
        return arrange_gains(gains, arm.joint_names, "the gains").with_drift(settings)
    if kind is not SignalKind.CURRENT:
        return build_nominal_gains(arm.joint_names, kind, settings)
    return estimate_gains(arm, run, prepare(run, settings), settings)


def _check_kinds(loaded: Run, empty: Sequence[Run]) -> None:
    for run in empty:
        one, other = run.description, loaded.description
        if one.kind is not other.kind:
            raise BadValueError(
                run.source, "signal", f"is {one.kind.value}, must be {other.kind.value} as the loaded run's"
            )
        if one.gravity != other.gravity:
            raise BadValueError(
                run.source, "gravity", f"is {one.gravity}, must be {other.gravity} as the loaded run's"
            )
