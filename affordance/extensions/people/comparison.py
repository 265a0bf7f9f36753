"""Compares learners on the same lifts by one-step-ahead log scores and BIC of each participant.

A learner's score is the log probability density of all pushes of a participant, each predicted from the pushes before
it, with free parameters averaged over their prior. More parameters therefore do not improve the score by themselves.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from affordance.arrays import Array
from affordance.extensions.people.fit import Question, score_ahead


class Comparison(NamedTuple):
    """Result of a comparison; mappings have the name of the learner as key.

    Attributes:
        participants: Names of the participants.
        scores: One-step-ahead log scores, (participants,).
        bic: Bayesian information criterion at the draw with the largest likelihood, (participants,).
        best_values: Values of the F free parameters at that draw, (participants, F).
        trials: Log scores of single pushes, (participants, N).
        noise: SD of the log likelihood at the same draw over the random numbers of particles, (participants,).
    """

    participants: list[str]
    scores: Mapping[str, Array]
    bic: Mapping[str, Array]
    best_values: Mapping[str, Array]
    trials: Mapping[str, Array]
    noise: Mapping[str, Array]

    def find_best(self, by: str = "scores") -> list[str]:
        """Returns the name of the best learner of each participant, by ``scores`` or ``bic``."""
        names = [*self.scores]
        values = [self.scores[name] if by == "scores" else -self.bic[name] for name in names]
        return [names[place] for place in np.argmax(values, axis=0)]

    def tabulate(self) -> pd.DataFrame:
        """Returns a table of scores and BIC, with differences from the best: one row per participant and learner."""
        rows = []
        for place, participant in enumerate(self.participants):
            best = max(each[place] for each in self.scores.values())
            least = min(each[place] for each in self.bic.values())
            for name in self.scores:
                score, bic = self.scores[name][place], self.bic[name][place]
                noise = self.noise[name][place]
                rows.append((participant, name, score, score - best, bic, bic - least, noise))
        columns = ["participant", "learner", "log_score", "behind_best", "bic", "above_best", "particle_noise"]
        return pd.DataFrame(rows, columns=columns)


def compare(questions: Sequence[Question]) -> Comparison:
    """Compares learners on the same lifts, one question per learner; without free parameters there is one draw."""
    lifts = questions[0].lifts
    scores, bic, best_values, trials, noise = {}, {}, {}, {}, {}
    counts = np.array([np.isfinite(person.pushes).sum() for person in lifts.people])
    for question in questions:
        normal = question.draw_prior()
        parts = question.compute_all(normal)  # (D, participants, N)
        name = question.learner.name
        trials[name] = np.stack([score_ahead(parts[:, place]) for place in range(parts.shape[1])])
        scores[name] = trials[name].sum(axis=1)
        totals = parts.sum(axis=2)
        bic[name] = len(question.free) * np.log(counts) - 2.0 * totals.max(axis=0)
        best = normal[totals.argmax(axis=0)]
        best_values[name], noise[name] = question.convert(best), question.estimate_noise(best)
    return Comparison([person.name for person in lifts.people], scores, bic, best_values, trials, noise)
