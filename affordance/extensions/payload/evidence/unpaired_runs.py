"""Builds evidence with a model of the empty arm, fitted to empty runs or taken from the arm's file.

Inertias in files are wrong by about ten per cent, and a wrist that is a hundred grams heavier than in its file looks
like a load of a hundred grams. The uncertainty of the links is therefore projected onto the payload.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.extensions.payload.evidence.evidence import Evidence, build_evidence, restore_compensated
from affordance.extensions.payload.evidence.fitted_arm import CELL, ArmRegression, FittedArm, build_link_scale
from affordance.extensions.payload.evidence.gains import Gains
from affordance.extensions.payload.evidence.joint_statistics import NUM_COLUMNS, ChannelSamples, compute_statistics
from affordance.extensions.payload.evidence.model_error import (
    build_phantom_covariance,
    estimate_sizes,
    project_link_errors,
    project_pulls,
)
from affordance.extensions.payload.evidence.payload_likelihood import ChannelPrior, PayloadLikelihood
from affordance.extensions.payload.recording.preparation import PreparedRun, prepare, prepare_alike
from affordance.extensions.payload.recording.run import Run
from affordance.extensions.payload.settings import IdentificationSettings
from affordance.plant.serial_chain import SerialChain

# Length of a stretch in cross-validation, and of the gap on either side, [cells].
_STRETCH, _GUARD = 8, 1
# Least number of held postures for fitting an arm. Intervals of simulated loads contain the truth from 8 postures on;
# with fewer, the equations often have no solution.
_FEWEST_POSTURES = 12
# Candidates for the friction that a fit leaves unexplained, as a fraction of each joint's friction.
_SHARES = np.geomspace(0.01, 1.0, 9)
# Friction scale for an arm from its file, because the signal contains the whole friction, not only its change.
WHOLE_FRICTION = 10.0


def fit_empty_arm(
    robot: SerialChain,
    runs: Sequence[PreparedRun],
    signals: Sequence[Array],
    gains: Gains,
    settings: IdentificationSettings,
    kept: Array | None = None,
) -> FittedArm:
    """Fits an arm to empty runs, and measures its errors with cross-validation.

    Args:
        robot: Arm.
        runs: Empty runs.
        signals: Signals of each run, shape (N, n) each.
        gains: Gains before the runs.
        settings: Settings of the identification.
        kept: Mask of the cells of half a second that are used, shape (cells,); None to use all.
    """
    regression = ArmRegression(robot, runs, signals, gains, settings)
    allowed = np.ones(regression.num_cells, dtype=bool) if kept is None else np.asarray(kept, dtype=bool)
    residuals = [np.full_like(signal, np.nan) for signal in signals]
    cells = np.flatnonzero(allowed)
    quadratics, squares, counts = [], np.zeros(robot.num_joints), np.zeros(robot.num_joints)
    for stretch in np.array_split(cells, max(2, round(len(cells) / _STRETCH))):
        rest = allowed.copy()
        rest[max(0, stretch[0] - _GUARD) : stretch[-1] + 1 + _GUARD] = False
        fitted = regression.fit(rest)
        for number, (run, signal) in enumerate(zip(runs, signals, strict=True)):
            of_run = np.flatnonzero(regression.run_of_cell == number)
            inside = stretch[np.isin(stretch, of_run)] - of_run[0]
            if not inside.size:
                continue
            length = regression.cell_lengths[number]
            rows = slice(int(inside[0]) * length, (int(inside[-1]) + 1) * length)
            part = run.select(rows)
            error = signal[rows] - fitted.predict(part)
            residuals[number][rows] = error
            samples = ChannelSamples.of_joints(
                robot.compute_payload_regressors(*part.motion),
                part.v,
                part.vdot,
                error,
                arm_torque=np.ones_like(error),
                min_speed=settings.min_speed,
            )
            statistics = compute_statistics(samples, round(settings.block / CELL) * length)
            w = np.zeros((robot.num_joints, NUM_COLUMNS))
            w[:, -1] = 1.0
            squares += np.maximum(statistics.sum_block_squares(w), statistics.sum_squares(w))
            counts += statistics.counts
            quadratics.append(statistics)
    variance = squares / np.maximum(counts, 1.0)
    fitted = regression.fit(allowed)
    size, speed = fitted.measure_friction(runs, settings.min_speed)
    of_joint, offset_sd = np.zeros((robot.num_joints, 3)), settings.get_prior(gains.kind).friction_sd

    def describe_friction(share: float) -> Array:
        """Returns SDs of friction, (n, 3), as a fraction of each joint's friction. Offsets differ in each run."""
        viscous = np.divide(share * size, speed, out=np.zeros_like(size), where=speed > 0.0)  # zero at rest
        return np.column_stack([share * size, viscous, np.full(len(size), offset_sd)])

    def list_stretches(share: float) -> list[PayloadLikelihood]:
        prior = ChannelPrior(
            gains.mean,
            np.zeros((robot.num_joints, 2, 2)),
            of_joint,
            describe_friction(share),
            has_arm=False,
        )
        return [PayloadLikelihood(statistics, prior, variance) for statistics in quadratics]

    phantom_mass, share = estimate_sizes(list_stretches, _SHARES)
    # Stretches of a single run do not reveal how much friction changes between runs.
    friction_left = describe_friction(float(np.hypot(share, settings.friction_drift)))
    return replace(
        fitted,
        least_variance=variance,
        phantom_mass=phantom_mass if settings.floor else 0.0,
        friction_left=friction_left,
        residual=tuple(residuals),
    )


def build_unpaired_evidence(
    robot: SerialChain, loaded: Run, empty: Sequence[Run], gains: Gains, settings: IdentificationSettings
) -> Evidence:
    """Subtracts the prediction of an arm fitted to empty runs from a loaded run.

    Raises:
        BadValueError: The empty runs have too few postures for a fit.
    """
    num = sum(len(run.q) for run in empty)
    if loaded.description.postures and num < _FEWEST_POSTURES:
        problem = f"has {num} postures, must have at least {_FEWEST_POSTURES} for an arm to be fitted to them"
        raise BadValueError(
            empty[0].source, "q", f"{problem}: hold the same postures with the load (without --unpaired)"
        )
    prepared, *without = prepare_alike([loaded, *empty], settings)
    signals = [
        restore_compensated(robot, run, part, gains.mean[:, 0]) for run, part in zip(empty, without, strict=True)
    ]
    return subtract_arm(robot, fit_empty_arm(robot, without, signals, gains, settings), loaded, prepared, settings)


def subtract_arm(
    robot: SerialChain, fitted: FittedArm, loaded: Run, prepared: PreparedRun, settings: IdentificationSettings
) -> Evidence:
    """Subtracts the prediction of a fitted arm from a loaded run."""
    predicted = fitted.predict(prepared)
    prepared = prepared._replace(signal=restore_compensated(robot, loaded, prepared, fitted.gain) - predicted)
    analysis = "unpaired: an arm fitted to other runs with an empty hand"
    evidence = build_evidence(
        robot, loaded.source, loaded.description.kind, prepared, settings, analysis=analysis, is_difference=True
    )
    covariance = evidence.phantom_covariance
    if settings.floor:
        # Variation between stretches of the empty runs, plus the remaining uncertainty of the links for this motion.
        open_links = project_link_errors(robot, prepared, evidence.samples, fitted.link_root)
        pulls = project_pulls(robot, prepared, evidence.samples)
        covariance = build_phantom_covariance(fitted.phantom_mass) + open_links + pulls
    return replace(
        evidence,
        least_variance=fitted.least_variance,
        phantom_covariance=covariance,
        friction_left=fitted.friction_left,
        notes=(f"the apparent load of the empty hand varies by {1e3 * fitted.phantom_mass:.0f} g (one SD)",),
    )


def build_file_evidence(
    robot: SerialChain, loaded: Run, empty: Sequence[Run], gains: Gains, settings: IdentificationSettings
) -> Evidence:
    """Builds the evidence of a loaded run with the arm's model from its file. Empty runs are not used."""
    prepared = prepare(loaded, settings)
    prepared = prepared._replace(signal=restore_compensated(robot, loaded, prepared, gains.mean[:, 0]))
    analysis = f"unpaired: the arm as in {robot.source}"
    evidence = build_evidence(
        robot, loaded.source, loaded.description.kind, prepared, settings, analysis=analysis, is_difference=False
    )
    covariance = evidence.phantom_covariance
    if settings.floor:
        covariance = project_link_errors(robot, prepared, evidence.samples, np.diag(build_link_scale(robot)))
    return replace(
        evidence,
        phantom_covariance=covariance,
        friction_scale=WHOLE_FRICTION,
        notes=(f"the arm's file may be wrong by {1e3 * np.sqrt(covariance[0, 0]):.0f} g at the tip",),
    )
