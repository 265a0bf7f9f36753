"""Comparison of learners on the same lifts: log scores one step ahead, and BIC, of each participant.

The score of a learner is the log probability density of all pushes of a participant, each predicted from those before
it, with free parameters averaged over their prior: a better fit by more parameters does not pay by itself.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from affordance.arrays import Array
from affordance.people.fit import Question, score_ahead


class Comparison(NamedTuple):
    """Comparison of learners.

    Attributes:
        participants: Names.
        scores: Log score one step ahead by learner, (participants,).
        bic: Bayesian information criterion by learner, at the best of all draws, (participants,).
        best_values: Values of the free parameters there by learner, (participants, F).
        trials: Scores of single pushes by learner, (participants, N).
    """

    participants: list[str]
    scores: Mapping[str, Array]
    bic: Mapping[str, Array]
    best_values: Mapping[str, Array]
    trials: Mapping[str, Array]

    def find_best(self, by: str = "scores") -> list[str]:
        """Finds the best learner of each participant, by ``scores`` or ``bic``."""
        names = [*self.scores]
        values = [self.scores[name] if by == "scores" else -self.bic[name] for name in names]
        return [names[place] for place in np.argmax(values, axis=0)]

    def tabulate(self) -> pd.DataFrame:
        """Tabulates scores and BIC, a row for each participant and learner, with the differences from the best."""
        rows = []
        for place, participant in enumerate(self.participants):
            best = max(each[place] for each in self.scores.values())
            least = min(each[place] for each in self.bic.values())
            for name in self.scores:
                score, bic = self.scores[name][place], self.bic[name][place]
                rows.append((participant, name, score, score - best, bic, bic - least))
        columns = ["participant", "learner", "log_score", "behind_best", "bic", "above_best"]
        return pd.DataFrame(rows, columns=columns)


def compare(questions: Sequence[Question]) -> Comparison:
    """Compares the learners of questions about the same lifts; those without free parameters have one draw."""
    lifts = questions[0].lifts
    scores, bic, best_values, trials = {}, {}, {}, {}
    counts = np.array([np.isfinite(person.pushes).sum() for person in lifts.people])
    for question in questions:
        normal = question.draw_prior()
        parts = question.compute_all(normal)  # (D, participants, N)
        name = question.learner.name
        trials[name] = np.stack([score_ahead(parts[:, place]) for place in range(parts.shape[1])])
        scores[name] = trials[name].sum(axis=1)
        totals = parts.sum(axis=2)
        bic[name] = len(question.free) * np.log(counts) - 2.0 * totals.max(axis=0)
        best_values[name] = question.convert(normal)[totals.argmax(axis=0)]
    return Comparison([person.name for person in lifts.people], scores, bic, best_values, trials)
