"""Names of the learners."""

import enum


class Pick(enum.Enum):
    """Rule by which a hypothesis about an object's kinds is adopted."""

    MAP = "map"  # the most probable one, for a working arm
    DRAWN = "drawn"  # one drawn by its probability, to simulate people


class Learner(enum.Enum):
    """Learner of densities."""

    DENSITY = "density"  # one density for each colour (paper)
    KINDS_MAP = "kinds_map"  # kinds within a colour, with the most probable hypothesis
    KINDS_DRAWN = "kinds_drawn"  # kinds within a colour, with a hypothesis drawn by its probability

    @property
    def pick(self) -> Pick | None:
        """Rule by which it adopts a hypothesis about an object's kinds; None if it has no kinds."""
        return {Learner.KINDS_MAP: Pick.MAP, Learner.KINDS_DRAWN: Pick.DRAWN}.get(self)

    @property
    def label(self) -> str:
        """Name in words, for figures and tables."""
        return {
            Learner.DENSITY: "one density for each colour",
            Learner.KINDS_MAP: "kinds, most probable",
            Learner.KINDS_DRAWN: "kinds, drawn",
        }[self]
