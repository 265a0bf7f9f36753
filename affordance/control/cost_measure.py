"""Cost measures for comparing motions."""

import enum


class CostMeasure(enum.Enum):
    """Cost measure of a motion with joint torques tau and joint rates v."""

    WORK = "absolute work"  # integral of sum_i |tau_i v_i| (paper, eq. 4)
    POSITIVE_WORK = "positive work"  # positive work only
    MUSCULAR_WORK = "muscular work"  # positive work plus negative work weighted by its metabolic cost
    EFFORT = "effort"  # integral of |tau|^2

    @property
    def negative_weight(self) -> float:
        """Weight of negative work relative to positive work, dimensionless."""
        return _NEGATIVE_WEIGHTS[self]


# Muscles do positive work with an efficiency of 0.25 and negative work with an efficiency of 1.20 (Margaria 1968,
# Int. Z. angew. Physiol. 25:339-351, from memory), so a joule of negative work costs 0.25 / 1.20 of the energy of a
# joule of positive work. On a sledge the efficiencies were 0.171 and 0.802, with the same ratio (Aura and Komi 1986,
# Int. J. Sports Med. 7:44-49, abstract).
_NEGATIVE_WEIGHTS = {
    CostMeasure.WORK: 1.0,
    CostMeasure.POSITIVE_WORK: 0.0,
    CostMeasure.MUSCULAR_WORK: 0.25 / 1.20,
    CostMeasure.EFFORT: 1.0,
}
