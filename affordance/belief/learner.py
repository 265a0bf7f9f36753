"""The learners, by name."""

import enum


class Pick(enum.Enum):
    """Which hypothesis about an object's kinds is taken for true."""

    MAP = "map"  # the most probable one, for an arm that is to work
    DRAWN = "drawn"  # one drawn by its probability, to simulate people


class Learner(enum.Enum):
    """What learns."""

    DENSITY = "density"  # one density for each colour (paper)
    KINDS_MAP = "kinds_map"  # kinds within a colour; takes the most probable hypothesis
    KINDS_DRAWN = "kinds_drawn"  # the same; takes one drawn by its probability

    @property
    def pick(self) -> Pick | None:
        """Which hypothesis about an object's kinds it takes; None if it has no kinds."""
        return {Learner.KINDS_MAP: Pick.MAP, Learner.KINDS_DRAWN: Pick.DRAWN}.get(self)
