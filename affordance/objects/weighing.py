"""Weighings of tools and of their parts."""

from typing import NamedTuple

# Standard deviation of a weighing if none is given, relative to the mass: a kitchen scale of 1 g with 100 g on it,
# and what a drawing leaves out, as paint and glue.
WEIGHING_SD = 0.01


class Weighing(NamedTuple):
    """Mass of a tool, or of some of its parts, that was measured."""

    parts: tuple[int, ...]  # indices of the parts that were weighed together; empty for the whole tool
    mass: float  # [kg]
    sd: float  # standard deviation of its error, [kg]
