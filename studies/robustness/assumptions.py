"""Assumptions that the paper does not state: plausible ranges, and samples from them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from affordance.arrays import Array
from affordance.files.bounded import read_yaml
from studies.random_streams import StudyStream

FILE = Path(__file__).parent / "assumptions.yaml"
# Largest base-2 logarithm of the sample size. The Sobol sequence is drawn in blocks whose sizes are powers of two.
_LOG2_MAX = 13

# Value of each assumption, by name.
type Setting = Mapping[str, float | str]


@dataclass(frozen=True)
class Assumption:
    """Assumption that the paper does not state."""

    name: str  # key in the file
    label: str  # description with unit
    source: str  # source of default and range
    default: float | str  # value in the simulations
    low: float = 0.0  # lower end of the range; 0 if there are choices
    high: float = 0.0  # upper end of the range; 0 if there are choices
    is_log: bool = False  # True if the logarithm is sampled uniformly
    choices: tuple[str, ...] = ()  # possible values; empty if there is a range
    weights: tuple[float, ...] = ()  # relative frequency of each choice, not necessarily normalised

    def place(self, u: float) -> float | str:
        """Returns the value at the quantile u of the range or choices, 0 <= u < 1."""
        if self.choices:
            ends = np.cumsum(self.weights) / np.sum(self.weights)
            return self.choices[min(int(np.searchsorted(ends, u, side="right")), len(self.choices) - 1)]
        if self.is_log:
            return float(self.low * (self.high / self.low) ** u)
        return float(self.low + (self.high - self.low) * u)


def load_assumptions(path: Path = FILE) -> tuple[Assumption, ...]:
    """Reads the assumptions, in the order of the file.

    Raises:
        ValueError: A default is not in the range or among the choices, or an entry has neither.
    """
    content = read_yaml(path)
    return tuple(_read(name, entry) for name, entry in content.items())


def list_defaults(assumptions: Sequence[Assumption]) -> dict[str, float | str]:
    """Returns the default setting."""
    return {each.name: each.default for each in assumptions}


def sample_places(num_assumptions: int, count: int, seed: int) -> Array:
    """Samples quantiles of all assumptions from a scrambled Sobol sequence, (count, num_assumptions).

    The sequence does not depend on ``count``.
    """
    rng = np.random.default_rng([seed, StudyStream.SETTINGS])
    sequence = qmc.Sobol(num_assumptions, scramble=True, rng=rng)
    points: Array = sequence.random_base2(min(_LOG2_MAX, max(9, int(np.ceil(np.log2(max(count, 1)))))))[:count]
    return points


def sample_settings(assumptions: Sequence[Assumption], count: int, seed: int) -> list[dict[str, float | str]]:
    """Samples settings that cover the ranges evenly."""
    places = sample_places(len(assumptions), count, seed)
    return [{each.name: each.place(float(u)) for each, u in zip(assumptions, row, strict=True)} for row in places]


def _read(name: str, entry: Mapping[str, object]) -> Assumption:
    fields = dict(entry)
    label, source, default = str(fields["label"]), " ".join(str(fields["source"]).split()), fields["default"]
    if isinstance(choices := fields.get("choices"), list):
        weights = fields.get("weights", [1.0] * len(choices))
        if default not in choices:
            raise ValueError(f"{name}: the default {default!r} is not among the choices")
        assert isinstance(weights, list)
        return Assumption(
            name,
            label,
            source,
            str(default),
            choices=tuple(map(str, choices)),
            weights=tuple(float(weight) for weight in weights),
        )
    ends = fields.get("range")
    if not isinstance(ends, list) or not isinstance(default, float):
        raise ValueError(f"{name}: needs a range of two numbers and a default, or choices")
    low, high = (float(end) for end in ends)
    if not low <= default <= high:
        raise ValueError(f"{name}: the default {default:g} is not from {low:g} to {high:g}")
    return Assumption(name, label, source, default, low, high, fields.get("scale") == "log")
