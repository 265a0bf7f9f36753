"""Weighings of tools and their parts."""

from typing import NamedTuple

# Default standard deviation of a weighing, relative to the mass: 100 g on a kitchen scale with steps of 1 g, and
# things that a drawing omits, such as paint and glue.
WEIGHING_SD = 0.01


class Weighing(NamedTuple):
    """Measured mass of a tool, or of some of its parts."""

    parts: tuple[int, ...]  # indices of the parts that were weighed together; empty for the whole tool
    mass: float  # measured mass, [kg]
    sd: float  # standard deviation of its error, [kg]
