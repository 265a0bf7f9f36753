"""Assumptions beyond the paper, the ranges in which they could lie, and samples of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from affordance.arrays import Array
from affordance.files.bounded import read_yaml
from studies.random_streams import StudyStream

FILE = Path(__file__).parent / "assumptions.yaml"
# Points of the sequence come in powers of two.
_LOG2_MAX = 13

# What a setting assumes, by the names of the assumptions.
type Setting = Mapping[str, float | str]


@dataclass(frozen=True)
class Assumption:
    """Assumption that the paper does not state."""

    name: str  # key of the assumption in the file
    label: str  # description in words, with its unit
    source: str  # source of default and range
    default: float | str  # value that the simulations use
    low: float = 0.0  # lower end of its range; 0 where it is a choice, as is high
    high: float = 0.0  # upper end
    is_log: bool = False  # true if the range is sampled evenly in its logarithm
    choices: tuple[str, ...] = ()  # values of a choice; empty for a range
    weights: tuple[float, ...] = ()  # relative frequency of each choice, of any sum

    def place(self, u: float) -> float | str:
        """The value at a place u of its range, 0 <= u < 1."""
        if self.choices:
            ends = np.cumsum(self.weights) / np.sum(self.weights)
            return self.choices[min(int(np.searchsorted(ends, u, side="right")), len(self.choices) - 1)]
        if self.is_log:
            return float(self.low * (self.high / self.low) ** u)
        return float(self.low + (self.high - self.low) * u)


def load_assumptions(path: Path = FILE) -> tuple[Assumption, ...]:
    """Reads the assumptions, in the order of the file.

    A default outside its range or choices, or an entry with neither of them, raises a ValueError.
    """
    content = read_yaml(path)
    return tuple(_read(name, entry) for name, entry in content.items())


def list_defaults(assumptions: Sequence[Assumption]) -> dict[str, float | str]:
    """The setting of the simulations."""
    return {each.name: each.default for each in assumptions}


def sample_places(num_assumptions: int, count: int, seed: int) -> Array:
    """Places of settings in the ranges, (count, num_assumptions): the beginning of a scrambled Sobol sequence.

    The first settings are the same however many are asked for.
    """
    rng = np.random.default_rng([seed, StudyStream.SETTINGS])
    sequence = qmc.Sobol(num_assumptions, scramble=True, rng=rng)
    points: Array = sequence.random_base2(min(_LOG2_MAX, max(9, int(np.ceil(np.log2(max(count, 1)))))))[:count]
    return points


def sample_settings(assumptions: Sequence[Assumption], count: int, seed: int) -> list[dict[str, float | str]]:
    """Draws settings that fill the ranges evenly."""
    places = sample_places(len(assumptions), count, seed)
    return [{each.name: each.place(float(u)) for each, u in zip(assumptions, row, strict=True)} for row in places]


def _read(name: str, entry: Mapping[str, object]) -> Assumption:
    fields = dict(entry)
    label, source, default = str(fields["label"]), " ".join(str(fields["source"]).split()), fields["default"]
    if isinstance(choices := fields.get("choices"), list):
        weights = fields.get("weights", [1.0] * len(choices))
        if default not in choices:
            raise ValueError(f"{name}: the default {default!r} is none of the choices")
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
