"""What a learner with kinds should believe, computed anew from all lifts so far, in moments and without short cuts.

Lifts are measurements y = R rho + e of an object's densities, e ~ N(0, V). Nothing here knows of information form,
of indices that shift, or of an update: every question is answered from the list of lifts and of what was decided.
"""

import itertools
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag
from scipy.stats import multivariate_normal

MODE, SD, DEVIATION_SD = 1000.0, 4000.0, 100.0


class BruteLift(NamedTuple):
    """One lift: the object, its colours, the kind decided for each of them (a name), and what was measured."""

    name: str
    colours: tuple[str, ...]
    kinds: tuple[str, ...]
    R: np.ndarray
    y: np.ndarray
    V: np.ndarray


def believe_kinds(lifts, names):
    """Mean and covariance of the densities of named kinds, each with the prior before the first of the lifts."""
    everyone = list(dict.fromkeys([*names, *(kind for lift in lifts for kind in lift.kinds)]))
    mean, covariance = np.full(len(everyone), MODE), SD**2 * np.eye(len(everyone))
    if lifts:
        H = np.vstack(
            [lift.R @ [[float(kind == name) for name in everyone] for kind in lift.kinds] for lift in lifts]
        )
        y = np.concatenate([lift.y for lift in lifts])
        noise = block_diag(*(lift.V + DEVIATION_SD**2 * lift.R @ lift.R.T for lift in lifts))
        gain = covariance @ H.T @ np.linalg.inv(H @ covariance @ H.T + noise)
        mean, covariance = mean + gain @ (y - H @ mean), covariance - gain @ H @ covariance
    return mean[: len(names)], covariance[: len(names), : len(names)]


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
    """Of a colour's kinds the one that most objects are of, of equals the oldest; None if there is none."""
    present, colour_of = list_present(lifts)
    kinds = [kind for kind in present if colour_of[kind] == colour]
    return max(kinds, key=lambda kind: (len(present[kind]), -born[kind])) if kinds else None


def believe_own(lifts, name, born, kappa):
    """Densities of an object's own before the next lift: {column: place}, mean, covariance; empty for a member.

    The chain of its last lifts in which a colour stayed outside the most populous kind, started at the kind.
    """
    columns, mean, covariance = [], np.zeros(0), np.zeros((0, 0))
    for number, lift in enumerate(lifts):
        before, after = lifts[:number], lifts[: number + 1]
        if lift.name == name:
            belief = describe_object(before, lift.colours, lift.kinds, name, born, kappa, (columns, mean, covariance))
            gain = belief[1] @ lift.R.T @ np.linalg.inv(lift.R @ belief[1] @ lift.R.T + lift.V)
            mean = belief[0] + gain @ (lift.y - lift.R @ belief[0])
            covariance = belief[1] - gain @ lift.R @ belief[1]
            columns, kinds, colours = list(range(len(lift.kinds))), lift.kinds, lift.colours
        if columns:
            odd = [
                place
                for place, column in enumerate(columns)
                if kinds[column] != find_most_populous(after, colours[column], born)
            ]
            columns = [columns[place] for place in odd]
            mean, covariance = mean[odd], covariance[np.ix_(odd, odd)]
    return columns, mean, covariance


def describe_object(lifts, colours, kinds, name, born, kappa, own):
    """Mean and covariance of an object's densities under a hypothesis about its kinds."""
    last = next((lift for lift in reversed(lifts) if lift.name == name), None)
    mean, covariance = believe_kinds(lifts, kinds)
    covariance = covariance + np.diag((kappa * np.maximum(mean, 10.0)) ** 2)
    columns, own_mean, own_covariance = own
    stays = [place for place, column in enumerate(columns) if last.kinds[column] == kinds[column]]
    for place in stays:
        column = columns[place]
        mean[column] = own_mean[place]
        covariance[column, :] = covariance[:, column] = 0.0
    for place, other in itertools.product(stays, stays):
        covariance[columns[place], columns[other]] = own_covariance[place, other]
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


def judge(lifts, name, colours, R, y, V, born, *, kappa, alpha=1.0, c=1.0):
    """Probability of every hypothesis about an object after a lift, {kinds: probability}; "new" is a new kind."""
    present, colour_of = list_present(lifts)
    candidates = [[kind for kind in present if colour_of[kind] == colour] + ["new"] for colour in colours]
    own = believe_own(lifts, name, born, kappa)
    logs = {}
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
        mean, covariance = describe_object(lifts, colours, named, name, born, kappa, own)
        logs[kinds] = np.log(prior) + multivariate_normal.logpdf(y, R @ mean, R @ covariance @ R.T + V)
    top = max(logs.values())
    weights = {kinds: np.exp(log - top) for kinds, log in logs.items()}
    return {kinds: weight / sum(weights.values()) for kinds, weight in weights.items()}
