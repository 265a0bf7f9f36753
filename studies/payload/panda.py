"""Adds torques of random payloads to a Panda's measured torques with real noise.

The sensors do not measure the added torques, so gains are exact here. Everything else is as on a real robot. The arm
is fitted outside the identified window and a margin of half a second on either side. Payloads are two or three boxes
in a row on the flange, with densities from foam to steel.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from affordance.arrays import Array, Mask
from affordance.extensions.payload.evidence.evidence import Evidence
from affordance.extensions.payload.evidence.fitted_arm import CELL, FittedArm
from affordance.extensions.payload.evidence.gains import build_nominal_gains
from affordance.extensions.payload.evidence.unpaired_runs import fit_empty_arm, subtract_arm
from affordance.extensions.payload.posterior.inference import infer
from affordance.extensions.payload.posterior.payload_belief import COM, MASS, MOMENTS, describe_bodies
from affordance.extensions.payload.recording.preparation import prepare
from affordance.extensions.payload.settings import IdentificationSettings, SignalKind
from affordance.objects.inertia import parameters_from_pseudo_inertia
from studies.payload.clones import PandaData

LENGTHS = (2, 5, 10)  # durations of the windows, [s]
_CONTROL = 5  # duration of the windows for comparison with white noise, [s]
_GUARD = 1  # [cells]
# Masses of payloads, edges across and along the row, [m], and densities, [kg/m^3], all log-uniform; and offsets
# across the row, [m].
_MASSES = (0.1, 3.0)
_LEAST_EDGES, _LARGEST_EDGES = (0.015, 0.015, 0.02), (0.15, 0.15, 0.18)
_DENSITIES = (300.0, 8000.0)
_OFFSET = 0.03
# A payload is drawn again until its mass is within a quarter of the drawn mass.
_TOLERANCE = 0.25


class Injections(NamedTuple):
    """Identified payloads for one duration of window, (N, 10), in the order of ``describe_bodies``."""

    truth: Array
    mean: Array  # posterior means
    sd: Array  # posterior standard deviations
    inside: Mask  # True if the 90 % interval contains the truth
    stretch: NDArray[np.int_]  # (N,); the part of the recording that contains the middle of the payload's window

    def summarise(self) -> dict[str, Any]:
        """Computes the coverage of 90 % intervals, and mass errors, [g], with the range over parts of the recording.

        Payloads of one part share its errors, so an interval over payloads would be too narrow.
        """
        numbers = self._measure()
        parts = [Injections(*(of[self.stretch == k] for of in self))._measure() for k in np.unique(self.stretch)]
        ranges = {name: [f(part[name] for part in parts) for f in (min, max)] for name in numbers}
        return {**numbers, "stretches": len(parts), "range_of_stretches": ranges}

    def _measure(self) -> dict[str, float]:
        errors = self.mean[:, 0] - self.truth[:, 0]
        return {
            "coverage_mass": float(self.inside[:, MASS].mean()),
            "coverage_com": float(self.inside[:, COM].mean()),
            "coverage_moments": float(self.inside[:, MOMENTS].mean()),
            "rmse_mass_g": 1e3 * float(np.sqrt(np.mean(errors**2))),
            "median_sd_mass_g": 1e3 * float(np.median(self.sd[:, 0])),
        }


def study_panda(
    data: PandaData, settings: IdentificationSettings, *, num_injections: int, seed: int
) -> dict[str, Any]:
    """Identifies random payloads in random windows.

    Returns: Coverage and errors for each duration of window, [s]. The key ``white_5`` is for windows of 5 s with
        errors assumed to be white noise.
    """
    study = PandaStudy(data, settings)
    white = replace(settings, correlated_noise=False, floor=False)
    found: dict[str, Any] = {
        str(length): study.inject(length, settings, num_injections=num_injections, seed=seed).summarise()
        for length in LENGTHS
    }
    found[f"white_{_CONTROL}"] = study.inject(_CONTROL, white, num_injections=num_injections, seed=seed).summarise()
    return found


class PandaStudy:
    """Prepared recording, with a cached arm for each window, fitted outside the window."""

    def __init__(self, data: PandaData, settings: IdentificationSettings) -> None:
        self._robot, self._run = data.robot, data.empty
        self._prepared = prepare(data.empty, settings)
        nominal = build_nominal_gains(data.robot.joint_names, SignalKind.JOINT_TORQUE, settings)
        self._gains = replace(nominal, covariance=np.zeros_like(nominal.covariance), source="exact: injected")
        self._length = round(CELL * self._prepared.rate)
        self._num_cells = len(self._prepared.times) // self._length
        self._regressors = data.robot.compute_payload_regressors(
            self._prepared.q, self._prepared.v, self._prepared.vdot
        )
        self._arms: dict[tuple[int, int, IdentificationSettings], FittedArm] = {}

    def inject(self, length: int, settings: IdentificationSettings, *, num_injections: int, seed: int) -> Injections:
        """Identifies random payloads in windows of a given duration, [s]."""
        found = []
        drawn = self._draw(length, settings, num_injections, seed)
        cells = round(length / CELL)
        num_stretches = max(1, round(self._num_cells / cells))
        for first, payload, evidence in tqdm(
            drawn, desc=f"Panda, {length} s", unit="payload", total=num_injections, disable=None
        ):
            if not settings.correlated_noise:
                evidence = replace(evidence, least_variance=np.zeros_like(evidence.least_variance))
            marginals = infer(evidence, self._gains, settings=settings).marginals
            truth = describe_bodies(payload[None])[0]
            inside = (marginals.low90 <= truth) & (truth <= marginals.high90)
            stretch = int((first + 0.5 * cells) / self._num_cells * num_stretches)
            found.append((truth, marginals.mean, marginals.sd, inside, stretch))
        return Injections(*(np.array(each) for each in zip(*found, strict=True)))

    def _draw(
        self, length: int, settings: IdentificationSettings, num_injections: int, seed: int
    ) -> Iterator[tuple[int, Array, Evidence]]:
        """Draws random windows, each with its first cell, a payload, (10,), and the evidence."""
        rng = np.random.default_rng((seed, length))
        num_windows = self._num_cells - round(length / CELL) + 1
        for _ in range(num_injections):
            first = int(rng.integers(num_windows))
            payload = draw_payload(rng, _MASSES)
            yield first, payload, self._build_evidence(first, length, payload, settings)

    def _build_evidence(self, first: int, length: int, payload: Array, settings: IdentificationSettings) -> Evidence:
        cells = round(length / CELL)
        arm = self._fit_outside(first, cells, settings)
        rows = slice(first * self._length, (first + cells) * self._length)
        part = self._prepared.select(rows)
        part = part._replace(signal=part.signal + self._regressors[rows] @ payload)
        return subtract_arm(self._robot, arm, self._run, part, settings)

    def _fit_outside(self, first: int, cells: int, settings: IdentificationSettings) -> FittedArm:
        key = (first, cells, settings)
        if key not in self._arms:
            kept = np.ones(self._num_cells, dtype=bool)
            kept[max(0, first - _GUARD) : first + cells + _GUARD] = False
            signal = self._prepared.signal
            self._arms[key] = fit_empty_arm(self._robot, [self._prepared], [signal], self._gains, settings, kept)
        return self._arms[key]


def draw_payload(rng: np.random.Generator, masses: tuple[float, float]) -> Array:
    """Draws a payload's parameters, (10,), at the flange.

    The mass is log-uniform within bounds, [kg]. The flange's z points outwards.
    """
    mass = np.exp(rng.uniform(np.log(masses[0]), np.log(masses[1])))
    while True:
        angle, z = rng.uniform(0.0, 2.0 * np.pi), 0.0
        R = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
        columns = []
        for _ in range(rng.integers(2, 4)):
            edges = np.exp(rng.uniform(np.log(_LEAST_EDGES), np.log(_LARGEST_EDGES)))
            centre = np.array([*rng.uniform(-_OFFSET, _OFFSET, 2), z + edges[2] / 2.0])
            columns.append(_build_column(edges, centre, R))
            z += edges[2]
        Phi = np.column_stack(columns)
        rho = np.exp(rng.uniform(np.log(_DENSITIES[0]), np.log(_DENSITIES[1]), Phi.shape[1]))
        if abs(float(Phi[0] @ rho) / mass - 1.0) < _TOLERANCE:
            payload: Array = Phi @ rho
            return payload


def _build_column(edges: Array, centre: Array, R: Array) -> Array:
    """Computes the inertial parameters of a box with a density of 1 kg/m^3."""
    volume = float(np.prod(edges))
    J = np.zeros((4, 4))
    J[:3, :3] = volume * (R @ np.diag(edges**2 / 12.0) @ R.T + np.outer(centre, centre))
    J[:3, 3] = J[3, :3] = volume * centre
    J[3, 3] = volume
    return parameters_from_pseudo_inertia(J)
