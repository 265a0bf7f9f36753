"""Injects payloads into the real noise of a Panda: torques of random payloads are added to its measured torques.

An injected payload passes through no sensor, so gains are exact here; everything else is as on a robot that holds it.
The arm is fitted outside the window in which a payload is identified; half a second on either side is left out, too.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from tqdm import tqdm

from affordance.arrays import Array
from affordance.identification.evidence.evidence import Evidence
from affordance.identification.evidence.fitted_arm import CELL, FittedArm
from affordance.identification.evidence.gains import build_nominal_gains
from affordance.identification.evidence.unpaired_runs import fit_empty_arm, subtract_arm
from affordance.identification.payload_claim import judge_claim
from affordance.identification.payload_formats import PayloadSetting
from affordance.identification.posterior.inference import infer
from affordance.identification.posterior.marginals import describe_bodies
from affordance.identification.posterior.payload_belief import PayloadBelief
from affordance.identification.recording.preparation import prepare
from affordance.identification.settings import IdentificationSettings, SignalKind
from studies.recorded.clones import PandaData
from studies.recorded.peers import TO_90, solve_least_squares
from studies.recorded.random_payloads import draw_payload

LENGTHS = (2, 5, 10)  # durations of the windows, [s]
_CONTROL = 5  # duration of the windows in which white noise is assumed for comparison, [s]
_MASSES = (0.1, 3.0)
_GUARD = 1  # [cells]
_WRONG = 3.0  # error of a wrong payload setting, in tolerances


class Injections(NamedTuple):
    """Identified payloads for one length of window; shapes (N,) or (N, 10), quantities as in payload_belief."""

    truth: Array  # true mass, centre of mass and moments of inertia about it
    mean: Array  # posterior means
    sd: Array  # posterior standard deviations
    inside: Array  # true where the 90 % interval contains the truth
    phantom: Array  # phantom mass of errors that do not average out, estimated outside the window, [kg]
    # Fractions of right payload settings that are accepted and of wrong ones that are found wrong, shape (N, 2).
    claims: Array

    @property
    def mass_rmse(self) -> float:
        """Root mean square error of the mass, [kg]."""
        return float(np.sqrt(np.mean((self.mean[:, 0] - self.truth[:, 0]) ** 2)))


class PandaResult(NamedTuple):
    """Results of the study on the Panda."""

    numbers: dict[str, Any]  # numbers for metrics.json
    details: dict[str, Any]  # further numbers, for details.json
    injections: dict[int, Injections]  # identified payloads, by length of window, [s]
    control: Injections  # payloads identified under the assumption of white noise
    # For each payload the error of the mass by least squares in the same window, [kg], and 1 if its 90 % interval
    # contains the truth, shape (N, 2).
    least_squares: Array


def study_panda(data: PandaData, settings: IdentificationSettings, *, num_injections: int, seed: int) -> PandaResult:
    """Identifies random payloads in random windows."""
    study = PandaStudy(data, settings)
    white = replace(settings, correlated_noise=False, floor=False)
    injections = {
        length: study.inject(length, settings, num_injections=num_injections, seed=seed) for length in LENGTHS
    }
    control = study.inject(_CONTROL, white, num_injections=num_injections, seed=seed)
    least_squares = study.solve_peer(_CONTROL, num_injections=num_injections, seed=seed)
    numbers = {
        "coverage_mass": {str(length): each.inside[:, 0].mean() for length, each in injections.items()},
        "rmse_mass_g_5s": 1e3 * injections[_CONTROL].mass_rmse,
        "white_coverage_mass_5s": control.inside[:, 0].mean(),
    }
    details = {
        "injections": num_injections,
        "coverage_com": {str(length): each.inside[:, 1:4].mean() for length, each in injections.items()},
        "coverage_moments": {str(length): each.inside[:, 4:7].mean() for length, each in injections.items()},
        "rmse_mass_g": {str(length): 1e3 * each.mass_rmse for length, each in injections.items()},
        "median_sd_mass_g": {str(length): 1e3 * np.median(each.sd[:, 0]) for length, each in injections.items()},
        "phantom_g": {str(length): 1e3 * np.median(each.phantom) for length, each in injections.items()},
        "white_sd_mass_g_5s": 1e3 * np.median(control.sd[:, 0]),
        "least_squares_coverage_mass_5s": least_squares[:, 1].mean(),
        "least_squares_rmse_mass_g_5s": 1e3 * np.sqrt(np.mean(least_squares[:, 0] ** 2)),
        "distinct_windows": {str(length): study.count_windows(length) for length in LENGTHS},
    }
    return PandaResult(numbers, details, injections, control, least_squares)


class PandaStudy:
    """Prepared recording, with a cache of the arm fitted outside each window."""

    def __init__(self, data: PandaData, settings: IdentificationSettings) -> None:
        self._robot, self._run = data.robot, data.empty
        self._prepared = prepare(data.empty, settings)
        nominal = build_nominal_gains(data.robot.joint_names, SignalKind.JOINT_TORQUE, settings)
        self.gains = replace(nominal, covariance=np.zeros_like(nominal.covariance), source="exact: injected")
        self._length = round(CELL * self._prepared.rate)
        self._num_cells = len(self._prepared.times) // self._length
        self._regressors = data.robot.compute_payload_regressors(
            self._prepared.q, self._prepared.v, self._prepared.vdot
        )
        self._arms: dict[tuple[int, int, IdentificationSettings], FittedArm] = {}

    def count_windows(self, length: int) -> int:
        """Counts the windows of a given length, [s]; most of them overlap."""
        return self._num_cells - round(length / CELL) + 1

    def inject(self, length: int, settings: IdentificationSettings, *, num_injections: int, seed: int) -> Injections:
        """Identifies random payloads in windows of a given length, [s]."""
        found = []
        drawn = self.draw(length, settings, num_injections, seed)
        for payload, evidence, phantom in tqdm(
            drawn, desc=f"Panda, {length} s", unit="payload", total=num_injections, disable=None
        ):
            if not settings.correlated_noise:
                evidence = replace(evidence, least_variance=np.zeros_like(evidence.least_variance))
            belief = infer(evidence, self.gains, settings=settings)
            marginals = belief.marginals
            truth = describe_bodies(payload[None])[0]
            inside = (marginals.low90 <= truth) & (truth <= marginals.high90)
            claims = _judge_settings(belief, PayloadSetting(truth[0], truth[1:4], truth[4:]))
            found.append((truth, marginals.mean, marginals.sd, inside, phantom, claims))
        return Injections(*(np.array(each, dtype=float) for each in zip(*found, strict=True)))

    def solve_peer(self, length: int, *, num_injections: int, seed: int) -> Array:
        """Computes errors of the mass by least squares, [kg], with 1 where the 90 % interval contains the truth.

        The payloads and windows are those of ``inject``.
        """
        found = []
        for payload, evidence, _ in self.draw(length, IdentificationSettings(), num_injections, seed):
            estimate = solve_least_squares(evidence, self.gains)
            error = estimate.parameters[0] - payload[0]
            found.append([error, float(abs(error) <= TO_90 * estimate.mass_sd)])
        return np.array(found)

    def draw(
        self, length: int, settings: IdentificationSettings, num_injections: int, seed: int
    ) -> Iterator[tuple[Array, Evidence, float]]:
        """Draws payloads, (10,), each with its evidence in a random window, and the phantom mass, [kg]."""
        rng = np.random.default_rng((seed, length))
        for _ in range(num_injections):
            first = int(rng.integers(self.count_windows(length)))
            payload = draw_payload(rng, _MASSES).parameters
            yield payload, *self._build_evidence(first, length, payload, settings)

    def _build_evidence(
        self, first: int, length: int, payload: Array, settings: IdentificationSettings
    ) -> tuple[Evidence, float]:
        cells = round(length / CELL)
        arm = self._fit_outside(first, cells, settings)
        rows = slice(first * self._length, (first + cells) * self._length)
        part = self._prepared.select(rows)
        part = part._replace(signal=part.signal + self._regressors[rows] @ payload)
        return subtract_arm(self._robot, arm, self._run, part, settings), arm.phantom_mass

    def _fit_outside(self, first: int, cells: int, settings: IdentificationSettings) -> FittedArm:
        key = (first, cells, settings)
        if key not in self._arms:
            kept = np.ones(self._num_cells, dtype=bool)
            kept[max(0, first - _GUARD) : first + cells + _GUARD] = False
            signal = self._prepared.signal
            self._arms[key] = fit_empty_arm(self._robot, [self._prepared], [signal], self.gains, settings, kept)
        return self._arms[key]


def _judge_settings(belief: PayloadBelief, true: PayloadSetting) -> tuple[float, float]:
    """Judges the true payload setting, and wrong ones that differ by three tolerances in mass or first moment.

    Returns:
        1 if the true setting is accepted, else 0; and the fraction of wrong settings that are found wrong.
    """
    verdict = judge_claim(belief, true)
    far, lever = _WRONG * verdict.mass_tolerance, _WRONG * verdict.moment_tolerance
    centres = [true.centre_of_mass + lever / true.mass * axis for axis in np.eye(3)]
    moment = true.mass * true.centre_of_mass
    wrong = [
        PayloadSetting(true.mass + far, moment / (true.mass + far)),
        *(PayloadSetting(true.mass, centre) for centre in centres),
    ]
    return float(verdict.verdict != "wrong"), float(
        np.mean([judge_claim(belief, w).verdict == "wrong" for w in wrong])
    )
