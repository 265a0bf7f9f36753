"""Evidence of trials, summed."""

from collections.abc import Iterable

from affordance.belief.density_belief import Prior
from affordance.extensions.memory.evidence_sums import EvidenceSums
from affordance.extensions.memory.trial_evidence import TrialEvidence


def sum_trials(trials: Iterable[TrialEvidence], prior: Prior) -> EvidenceSums:
    """Sums the evidence of trials, which must be in the order of their times."""
    sums = EvidenceSums(prior)
    sums.add(list(trials))
    return sums
