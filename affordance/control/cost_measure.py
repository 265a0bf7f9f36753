"""Measures of cost by which motions are compared."""

import enum


class CostMeasure(enum.Enum):
    """Cost measure of a motion; tau are the joints' torques and v their rates."""

    WORK = "absolute work"  # integral of sum_i |tau_i v_i|: braking costs as much as driving (paper, eq. 4)
    POSITIVE_WORK = "positive work"  # braking is free
    MUSCULAR_WORK = "muscular work"  # positive work, and negative work weighted by its metabolic cost
    EFFORT = "effort"  # integral of |tau|^2

    @property
    def negative_weight(self) -> float:
        """Weight of negative work relative to positive work, dimensionless."""
        return _NEGATIVE_WEIGHTS[self]


# Muscles do positive work with an efficiency of 0.25 and negative work with one of 1.20 (Margaria 1968, Int. Z.
# angew. Physiol. 25:339-351, from memory): a joule of braking takes 0.25 / 1.20 of the energy of one of driving. On a
# sledge 0.171 and 0.802 were found, the same quotient (Aura and Komi 1986, Int. J. Sports Med. 7:44-49, abstract).
_NEGATIVE_WEIGHTS = {
    CostMeasure.WORK: 1.0,
    CostMeasure.POSITIVE_WORK: 0.0,
    CostMeasure.MUSCULAR_WORK: 0.25 / 1.20,
    CostMeasure.EFFORT: 1.0,
}
