"""Judgements of a learner with kinds, computed anew from all lifts so far, in moments and without short cuts.

Lifts are measurements y = R rho + e of an object's densities, e ~ N(0, V). Nothing here knows of information form,
of indices that shift, or of an update: every question is answered from the list of lifts and of what was decided,
and from what is believed of the kinds and of odd objects before the lift, which other tests compare with quadrature.
"""

import itertools
from typing import NamedTuple

import numpy as np
from numpy.polynomial.hermite_e import hermegauss
from scipy.stats import multivariate_normal

MODE, SD, SPREAD = 1000.0, 4000.0, 2.0


class BruteLift(NamedTuple):
    """One lift: the object, its colours, the kind decided for each of them (a name), and what was measured."""

    name: str
    colours: tuple[str, ...]
    kinds: tuple[str, ...]
    R: np.ndarray
    y: np.ndarray
    V: np.ndarray


def list_present(lifts):
    """The kinds that objects are of now, {kind: set of objects}, and the colour of each."""
    last = {lift.name: lift for lift in lifts}
    present, colour_of = {}, {}
    for name, lift in last.items():
        for colour, kind in zip(lift.colours, lift.kinds, strict=True):
            present.setdefault(kind, set()).add(name)
            colour_of[kind] = colour
    return present, colour_of


def find_most_populous(lifts, colour, born):
    """Kind of a colour that most objects are of, the oldest of equals; None if there is none."""
    present, colour_of = list_present(lifts)
    kinds = [kind for kind in present if colour_of[kind] == colour]
    return max(kinds, key=lambda kind: (len(present[kind]), -born[kind])) if kinds else None


def list_odd_columns(lifts, name, born):
    """Columns of an object that stayed outside the most populous kind since its last lift; empty for a member."""
    columns = []
    for number, lift in enumerate(lifts):
        if lift.name == name:
            columns, kinds, colours = list(range(len(lift.kinds))), lift.kinds, lift.colours
        after = lifts[: number + 1]
        columns = [column for column in columns if kinds[column] != find_most_populous(after, colours[column], born)]
    return columns


class Known(NamedTuple):
    """What is believed before a lift: means and covariance of named kinds, and the odd object's own densities."""

    names: list[str]
    mean: np.ndarray
    covariance: np.ndarray
    own_mean: np.ndarray
    own_covariance: np.ndarray

    def believe(self, kinds, new):
        """Mean and covariance of kinds, of which the new ones have a mean and an SD of their own."""
        mean, covariance = np.zeros(len(kinds)), np.zeros((len(kinds), len(kinds)))
        for i, kind in enumerate(kinds):
            mean[i] = new[kind][0] if kind in new else self.mean[self.names.index(kind)]
            for j, other in enumerate(kinds):
                if kind in new:
                    covariance[i, j] = new[kind][1] ** 2 * (i == j)
                elif other not in new:
                    covariance[i, j] = self.covariance[self.names.index(kind), self.names.index(other)]
        return mean, covariance


def predict_new(lifts, colour, born, known):
    """Mean and SD of a kind that is new: those of all materials for the first of its colour.

    Of a further one they are in proportion to the root mean square of the most populous kind's density.
    """
    populous = find_most_populous(lifts, colour, born)
    if populous is None:
        return MODE, SD
    (mean,), ((variance,),) = known.believe([populous], {})
    nodes, weights = hermegauss(3)  # exact for the square of a normal variable
    reference = np.sqrt(weights @ (mean + np.sqrt(variance) * nodes) ** 2 / weights.sum())
    return reference, SPREAD * reference


def describe_object(lifts, believed, kinds, name, kappa, own, breadth):
    """Mean and covariance of an object's densities by what is believed of its kinds; some of their breadths."""
    last = next((lift for lift in reversed(lifts) if lift.name == name), None)
    mean, covariance = believed[0].copy(), believed[1]
    breadths = [breadth.get(kind, kappa * max(rho, 10.0)) for kind, rho in zip(kinds, mean, strict=True)]
    covariance = covariance + np.diag(breadths) ** 2
    columns, own_mean, own_covariance = own
    stays = [column for column in columns if last.kinds[column] == kinds[column]]
    for column in stays:
        mean[column] = own_mean[column]
        covariance[column, :] = covariance[:, column] = 0.0
    for column, other in itertools.product(stays, stays):
        covariance[column, other] = own_covariance[column, other]
    return mean, covariance


def compute_prior(lifts, name, colour, column, kind, *, alpha, c):
    """Probability that a colour of an object is of a kind before its next lift, by the definition."""
    present, colour_of = list_present(lifts)
    counts = {k: len(objects - {name}) for k, objects in present.items() if colour_of[k] == colour}
    N = sum(counts.values())
    g = {k: count / (N + alpha) for k, count in counts.items()}
    share = g.get(kind, alpha / (N + alpha))
    mine = [lift for lift in lifts if lift.name == name]
    if not mine:
        return share
    z, n = mine[-1].kinds[column], 0
    for lift in reversed(mine):
        if lift.kinds[column] != z:
            break
        n += 1
    return (n * (kind == z) + c * share) / (n + c)


def condition(mean, covariance, R, y, V):
    """Mean and covariance after a measurement."""
    gain = covariance @ R.T @ np.linalg.inv(R @ covariance @ R.T + V)
    return mean + gain @ (y - R @ mean), covariance - gain @ R @ covariance


def judge(lifts, name, colours, R, y, V, born, known, *, kappa, alpha=1.0, c=1.0):
    """Probability of every hypothesis about an object after a lift, {kinds: probability}; "new" is a new kind.

    Returns: These; and for each hypothesis what its new kinds would start with, {kinds: {column: (mean, sd)}}.
    """
    present, colour_of = list_present(lifts)
    candidates = [[kind for kind in present if colour_of[kind] == colour] + ["new"] for colour in colours]
    own = list_odd_columns(lifts, name, born), known.own_mean, known.own_covariance
    new = {f"new {column}": predict_new(lifts, colour, born, known) for column, colour in enumerate(colours)}
    logs, starts = {}, {}
    for kinds in itertools.product(*candidates):
        named = tuple(f"new {column}" if kind == "new" else kind for column, kind in enumerate(kinds))
        prior = np.prod(
            [
                compute_prior(lifts, name, colour, column, kind, alpha=alpha, c=c)
                for column, (colour, kind) in enumerate(zip(colours, kinds, strict=True))
            ]
        )
        if prior == 0.0:
            continue
        further = {column: kind for column, kind in enumerate(named) if kind in new and new[kind] != (MODE, SD)}
        breadth = {kind: kappa * new[kind][0] for kind in further.values()}
        believed = known.believe(named, new)
        for _ in range(200):  # to a fixed point
            belief = describe_object(lifts, believed, named, name, kappa, own, breadth)
            after = condition(*belief, R, y, V)[0]
            before, breadth = breadth, {kind: kappa * max(after[column], 0.0) for column, kind in further.items()}
            if breadth == before:
                break
        mean, covariance = belief
        logs[kinds] = np.log(prior) + multivariate_normal.logpdf(y, R @ mean, R @ covariance @ R.T + V)
        starts[kinds] = {
            column: (new[kind][0], max(SPREAD * max(new[kind][0], after[column]), 0.0 if column in further else SD))
            for column, kind in enumerate(named)
            if kind in new
        }
    top = max(logs.values())
    weights = {kinds: np.exp(log - top) for kinds, log in logs.items()}
    return {kinds: weight / sum(weights.values()) for kinds, weight in weights.items()}, starts
