"""Tests if two payloads can be the same body, given the uncertainty of both."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy

from affordance.arrays import Array
from affordance.exceptions import BadValueError, show_value
from affordance.extensions.payload.payload_setting import read_payload
from affordance.files.bounded import read_json
from affordance.objects.inertia import NUM_PARAMETERS, build_transform_map

NAMES = ("mass", "centre x", "centre y", "centre z", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
UNITS = ("kg", "m", "m", "m", *["kg m^2"] * 6)
_DIFFERENT, _SAME = 0.01, 0.05  # p-values below which bodies are different, and from which they may be the same
# Largest SDs of differences at which two payloads can be called the same: of the mass, as a fraction of the mass or
# of 1 kg if lighter, as for ``--claimed``; and of the centre of mass, [m].
_RESOLVED, _LEAST, _RESOLVED_CENTRE = 0.05, 1.0, 0.01


class Estimate(NamedTuple):
    """Payload read from a file, in a frame T."""

    name: str  # name of the file
    frame: str  # name of T; empty if the file does not name it
    mean: Array  # the first k of the ten inertial parameters about To, shape (k,), k = 1, 4 or 10
    covariance: Array  # their covariance, shape (k, k); zero for a data sheet
    is_trusted: bool = True

    def express(self, frame: str, X_FT: Array) -> "Estimate":
        """Expresses the payload in another frame F, in which T has the pose X_FT, shape (4, 4)."""
        k = len(self.mean)
        A = build_transform_map(X_FT)[:k, :k]
        return self._replace(frame=frame, mean=A @ self.mean, covariance=A @ self.covariance @ A.T)

    def describe(self) -> tuple[Array, Array]:
        """Computes mass, centre of mass and moments about To, and their SDs, shape (k,) each."""
        k, values = len(self.mean), self.mean.copy()
        J = np.eye(k)
        if k > 1:
            values[1:4] /= self.mean[0]
            J[1:4, 1:4] /= self.mean[0]
            J[1:4, 0] = -values[1:4] / self.mean[0]
        return values, np.sqrt(np.maximum(np.diagonal(J @ self.covariance @ J.T), 0.0))


class Comparison(NamedTuple):
    """Result of testing if two payloads are the same body.

    Attributes:
        verdict: "same", "different" or "open".
        p_value: Probability of a larger difference between two estimates of the same body.
        values: Values of both payloads for each compared parameter, shape (2, k).
        sds: SDs of the values, shape (2, k).
        decides: Parameter that differs most, or if the verdict is open, the measurement that would decide; may be
            empty.
    """

    verdict: str
    p_value: float
    values: Array
    sds: Array
    decides: str

    @property
    def apart(self) -> Array:
        """Differences of the parameters, each divided by the SD of the difference, shape (k,)."""
        sd = np.hypot(*self.sds)
        return np.asarray((self.values[1] - self.values[0]) / np.maximum(sd, np.finfo(float).tiny))

    def to_dict(self) -> dict[str, Any]:
        """Returns the comparison for JSON, in SI units."""
        return self._asdict() | {"parameters": list(NAMES[: len(self.apart)]), "apart": self.apart}


def read_estimate(path: Path) -> Estimate:
    """Reads a payload from JSON of ``identify`` or ``weigh``, or from a setting in YAML or JSON.

    A setting has the keys mass, com, inertia and frame.

    Raises:
        BadValueError: The file cannot be read, or does not contain a payload.
    """
    content = read_json(path) if path.suffix.lower() == ".json" else {}
    if not isinstance(content, dict):
        raise BadValueError(path, "", "is not a mapping of keys to values, must be one")
    if "parameters_covariance" not in content:
        setting = read_payload(path)
        mean = (
            setting.parameters
            if setting.inertia is not None
            else setting.mass * np.array([1.0, *setting.centre_of_mass])
        )
        return Estimate(path.name, setting.frame, mean, np.zeros((len(mean), len(mean))))
    try:
        mean = np.array(content["parameters"], dtype=float)
        covariance = np.array(content["parameters_covariance"], dtype=float)
    except (KeyError, TypeError, ValueError) as error:
        raise BadValueError(path, "parameters", "are missing or not numbers, must be from identify") from error
    k = len(mean) if mean.ndim == 1 else 0
    if k not in (4, NUM_PARAMETERS) or covariance.shape != (k, k):
        raise BadValueError(
            path, "parameters_covariance", f"has the shape {covariance.shape}, must have (4, 4) or (10, 10)"
        )
    if not (np.isfinite(mean).all() and np.isfinite(covariance).all() and mean[0] > 0.0):
        raise BadValueError(
            path, "parameters", f"begin with {show_value(float(mean[0]))}, must be finite, with a positive mass"
        )
    return Estimate(path.name, str(content.get("frame", "")), mean, covariance, bool(content.get("trusted", True)))


def compare_estimates(first: Estimate, second: Estimate) -> Comparison:
    """Compares the parameters that two payloads have in common.

    If the frames differ, only the masses are compared.

    Raises:
        BadValueError: Neither payload has an uncertainty.
    """
    k = min(len(first.mean), len(second.mean))
    if first.frame and second.frame and first.frame != second.frame:
        k = 1
    one, other = (each._replace(mean=each.mean[:k], covariance=each.covariance[:k, :k]) for each in (first, second))
    covariance, away = one.covariance + other.covariance, other.mean - one.mean
    if not covariance[0, 0] > 0.0:
        raise BadValueError(
            first.name, "", f"has no uncertainty, nor has {second.name}: one must be of identify or weigh"
        )
    scale = np.sqrt(np.maximum(np.diagonal(covariance), np.finfo(float).tiny))
    correlation = covariance / np.outer(scale, scale) + 1e-9 * np.eye(k)
    distance = float(away / scale @ np.linalg.solve(correlation, away / scale))
    p_value = float(scipy.special.chdtrc(k, distance))
    (values, sds), (other_values, other_sds) = one.describe(), other.describe()
    both = np.hypot(sds, other_sds)
    most = np.array([_RESOLVED * max(values[0], _LEAST), *[_RESOLVED_CENTRE] * 3])[:k]
    worst = int(np.argmax(both[: len(most)] / most))
    verdict = "different" if p_value < _DIFFERENT else "open"
    if p_value >= _SAME and both[worst] <= most[worst]:
        verdict = "same"
    far = int(np.argmax(np.abs(other_values - values) / np.maximum(both, np.finfo(float).tiny)))
    decides = f"the {NAMES[far]} differs most" if verdict == "different" else ""
    if verdict == "open":
        open_ = worst if both[worst] > most[worst] else far
        wide, sd = max(((one, sds[open_]), (other, other_sds[open_])), key=lambda each: float(each[1]))
        decides = f"a smaller SD of the {NAMES[open_]} in {wide.name}, now {sd:.2g} {UNITS[open_]}"
    return Comparison(verdict, p_value, np.array([values, other_values]), np.array([sds, other_sds]), decides)
