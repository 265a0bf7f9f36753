"""Beliefs of a learner with kinds, computed anew from all lifts so far, in moments and without short cuts.

Lifts are measurements y = R rho + e of an object's densities, e ~ N(0, V). Nothing here knows of information form,
of indices that shift, or of an update: every question is answered from the list of lifts and of what was decided,
and from what each kind started with, {kind: (mean, sd)}.
"""

import itertools
from typing import NamedTuple

import numpy as np
from numpy.polynomial.hermite_e import hermegauss
from scipy.linalg import block_diag
from scipy.stats import multivariate_normal

MODE, SD, DEVIATION, SPREAD = 1000.0, 4000.0, 0.06, 2.0


class BruteLift(NamedTuple):
    """One lift: the object, its colours, the kind decided for each of them (a name), and what was measured."""

    name: str
    colours: tuple[str, ...]
    kinds: tuple[str, ...]
    R: np.ndarray
    y: np.ndarray
    V: np.ndarray


def believe_kinds(lifts, names, priors):
    """Mean and covariance of the densities of named kinds, each with its prior before the first of the lifts."""
    everyone = list(dict.fromkeys([*names, *(kind for lift in lifts for kind in lift.kinds)]))
    mean = np.array([priors[name][0] for name in everyone])
    covariance = np.diag([priors[name][1] ** 2 for name in everyone])
    if lifts:
        H = np.vstack(
            [lift.R @ [[float(kind == name) for name in everyone] for kind in lift.kinds] for lift in lifts]
        )
        y = np.concatenate([lift.y for lift in lifts])
        R = block_diag(*(lift.R for lift in lifts))
        runs = list_runs(lifts)
        same = np.array([[float(one == other) for other in runs] for one in runs])
        shared = np.block(
            [
                [each * np.eye(len(one.kinds), len(other.kinds)) for each, other in zip(row, lifts, strict=True)]
                for row, one in zip(same, lifts, strict=True)
            ]
        )
        scatter = np.diag(DEVIATION * np.concatenate([estimate_own(lifts, runs, run) for run in runs]))
        noise = block_diag(*(lift.V for lift in lifts)) + R @ scatter @ shared @ scatter @ R.T
        gain = covariance @ H.T @ np.linalg.inv(H @ covariance @ H.T + noise)
        mean, covariance = mean + gain @ (y - H @ mean), covariance - gain @ H @ covariance
    return mean[: len(names)], covariance[: len(names), : len(names)]


def estimate_own(lifts, runs, run):
    """Densities of an object by the lifts of a run alone, nearly as common to all its colours where these allow it.

    Least squares of what was measured, in which each density is a further measurement of the common density that
    fits best, with an SD of the root mean square of that.
    """
    mine = [lift for lift, each in zip(lifts, runs, strict=True) if each == run]
    weights = [np.linalg.cholesky(np.linalg.inv(lift.V)).T for lift in mine]
    A = np.vstack([weight @ lift.R for weight, lift in zip(weights, mine, strict=True)])
    y = np.concatenate([weight @ lift.y for weight, lift in zip(weights, mine, strict=True)])
    alike, m = A.sum(axis=1), A.shape[1]
    common, variance = alike @ y / (alike @ alike), 1.0 / (alike @ alike)
    rms = np.sqrt(common**2 + variance)
    return np.linalg.lstsq(np.vstack([A, np.eye(m) / rms]), np.append(y, np.full(m, common / rms)))[0]


def list_runs(lifts):
    """The runs of lifts in which an object stayed of its kinds, a (name, number) a lift: its deviation is one."""
    runs, last = [], {}
    for number, lift in enumerate(lifts):
        kinds, run = last.get(lift.name, (None, None))
        run = run if kinds == lift.kinds else number
        last[lift.name] = (lift.kinds, run)
        runs.append((lift.name, run))
    return runs


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


def believe_own(lifts, name, born, kappa, priors):
    """Densities of an object's own before the next lift: {column: place}, mean, covariance; empty for a member.

    The chain of its last lifts in which a colour stayed outside the most populous kind, started at the kind.
    """
    columns, mean, covariance = [], np.zeros(0), np.zeros((0, 0))
    for number, lift in enumerate(lifts):
        before, after = lifts[:number], lifts[: number + 1]
        if lift.name == name:
            founded = [kind for kind in lift.kinds if kind not in {k for each in before for k in each.kinds}]
            own = (columns, mean, covariance)
            belief = describe_object(
                before,
                believe_kinds(before, lift.kinds, priors),
                lift.kinds,
                name,
                kappa,
                own,
                breadth=dict.fromkeys(founded, 0.0),
            )
            mean, covariance = condition(*belief, lift.R, lift.y, lift.V)
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


def predict_new(lifts, colour, born, priors):
    """Mean and SD of a kind that is new: those of all materials for the first of its colour.

    Of a further one they are in proportion to the root mean square of the most populous kind's density.
    """
    populous = find_most_populous(lifts, colour, born)
    if populous is None:
        return MODE, SD
    (mean,), ((variance,),) = believe_kinds(lifts, [populous], priors)
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


def condition(mean, covariance, R, y, V):
    """Mean and covariance after a measurement."""
    gain = covariance @ R.T @ np.linalg.inv(R @ covariance @ R.T + V)
    return mean + gain @ (y - R @ mean), covariance - gain @ R @ covariance


def judge(lifts, name, colours, R, y, V, born, priors, *, kappa, alpha=1.0, c=1.0):
    """Probability of every hypothesis about an object after a lift, {kinds: probability}; "new" is a new kind.

    Returns: These; and for each hypothesis what its new kinds would start with, {kinds: {column: (mean, sd)}}.
    """
    present, colour_of = list_present(lifts)
    candidates = [[kind for kind in present if colour_of[kind] == colour] + ["new"] for colour in colours]
    own = believe_own(lifts, name, born, kappa, priors)
    new = {f"new {column}": predict_new(lifts, colour, born, priors) for column, colour in enumerate(colours)}
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
        believed = believe_kinds(lifts, named, priors | new)
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
