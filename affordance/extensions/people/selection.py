"""Random-effects Bayesian model selection for a group whose participants may have different learners.

The frequencies r of L learners in the population have a uniform Dirichlet prior. Each participant has one learner, so
p(data | r) is the product over participants of sum_l r_l p(data of participant | learner l) (Stephan and others 2009,
NeuroImage 46:1004). The protected exceedance probability takes into account that all learners may be equally frequent
(Rigoux and others 2014, NeuroImage 84:971). Both papers use a variational posterior; this module uses importance
sampling from the prior.
"""

from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp, softmax

from affordance.arrays import Array

_DRAWS = 100_000


class Selection(NamedTuple):
    """Posterior about the frequencies of L learners, given N participants.

    Attributes:
        people: Probability that a participant has a learner, (N, L).
        frequencies: Expected frequency of each learner in the population, (L,).
        exceedance: Exceedance probability that a learner is more frequent than any other, (L,).
        protected: Protected exceedance probability, (L,).
        equal: Probability that all learners are equally frequent.
    """

    people: Array
    frequencies: Array
    exceedance: Array
    protected: Array
    equal: float


def select_learners(log_evidence: Array, seed: int = 0) -> Selection:
    """Estimates the frequencies of learners from the log evidence of each participant and learner, (N, L)."""
    L = log_evidence.shape[1]
    relative = np.exp(log_evidence - log_evidence.max(axis=1, keepdims=True))
    r = np.random.default_rng(seed).dirichlet(np.ones(L), _DRAWS)
    of_people = r @ relative.T  # (draws, N)
    log_p = np.log(of_people).sum(axis=1)
    weights = softmax(log_p)
    people = relative * ((weights[:, None] / of_people).T @ r)
    exceedance = np.bincount(r.argmax(axis=1), weights, minlength=L)
    equal = float(1.0 / (1.0 + np.exp(logsumexp(log_p) - np.log(_DRAWS) - np.log(relative.mean(axis=1)).sum())))
    return Selection(people, weights @ r, exceedance, (1.0 - equal) * exceedance + equal / L, equal)
