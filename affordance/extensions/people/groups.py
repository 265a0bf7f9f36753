"""Hierarchical fits of groups, based on separate fits to their participants.

    z_ip ~ N(mean_gp, spread_p^2)       parameter p of participant i in group g
    mean_gp ~ N(0, 1/2),  spread_p^2 ~ 1/2 times chi-squared with one degree of freedom

Parameters are standardised: z is the normal score of a value, with prior N(0, 1) in a separate fit. The hierarchical
prior has the same total variance, half between groups and half within. The first stage samples the posterior of each
participant separately. The second stage is a Gibbs sampler that proposes these draws with weights
N(z; mean, spread^2) / N(z; 0, 1) (Lunn and others 2013, J. R. Stat. Soc. C 62:551).
"""

import itertools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.special import logsumexp

from affordance.arrays import Array
from affordance.extensions.people.likelihood import FreeParameter

_SWEEPS, _BURN_IN = 2000, 200
_HALF = 0.5  # prior variance of group means, and prior mean of the variance within groups
_FEW = 10.0  # smallest effective number of draws of a participant for reliable group estimates
# Grid of spreads for the Gibbs sampler, in SDs of the prior of a participant.
_SPREADS = np.geomspace(0.02, 4.0, 200)


class GroupDraws(NamedTuple):
    """Draws (S) from the posterior of G groups and N participants, in standardised parameters.

    Attributes:
        means: Mean of each group, (S, G, F).
        spreads: SD between participants within groups, the same for all groups, (S, F).
        people: Parameters of each participant, (S, N, F).
        effective: Effective number of separate draws for each participant after weighting, (N,).
    """

    means: Array
    spreads: Array
    people: Array
    effective: Array


def draw_groups(own: Sequence[Array], groups: Sequence[str], seed: int) -> GroupDraws:
    """Samples group means, spreads within groups, and parameters of participants.

    Args:
        own: Draws from separate fits to N participants, (D, F) each, in standard normal numbers.
        groups: Name of the group of each participant; groups are numbered in order of first occurrence.
        seed: Seed of the random numbers.
    """
    z, names = np.stack(own), list(dict.fromkeys(groups))  # (N, D, F)
    member = np.array([names.index(each) for each in groups])
    N, D, F = z.shape
    G, rng = len(names), np.random.default_rng(seed)
    is_member = (member == np.arange(G)[:, None]).astype(float)
    count = is_member.sum(axis=1)[:, None]
    log_width = np.log(np.gradient(_SPREADS))[:, None]
    log_spread_prior = log_width - 0.5 * _SPREADS[:, None] ** 2 / _HALF - N * np.log(_SPREADS)[:, None]
    means, spreads = np.zeros((G, F)), np.ones(F)
    kept_means, kept_spreads, kept = np.empty((_SWEEPS, G, F)), np.empty((_SWEEPS, F)), np.empty((_SWEEPS, N, F))
    effective = np.zeros(N)
    for sweep in range(-_BURN_IN, _SWEEPS):
        log_weights = (0.5 * z**2 - 0.5 * ((z - means[member][:, None]) / spreads) ** 2).sum(axis=2)  # (N, D)
        weights = np.exp(log_weights - logsumexp(log_weights, axis=1, keepdims=True))
        chosen = (weights.cumsum(axis=1) < rng.random((N, 1))).sum(axis=1)
        person = z[np.arange(N), np.minimum(chosen, D - 1)]
        squares = ((person - means[member]) ** 2).sum(axis=0)
        log_p = log_spread_prior - 0.5 * squares / _SPREADS[:, None] ** 2  # (nodes, F)
        spreads = _SPREADS[(log_p + rng.gumbel(size=log_p.shape)).argmax(axis=0)]
        precision = 1.0 / _HALF + count / spreads**2
        means = is_member @ person / spreads**2 / precision + rng.standard_normal((G, F)) / np.sqrt(precision)
        if sweep >= 0:
            kept_means[sweep], kept_spreads[sweep], kept[sweep] = means, spreads, person
            effective += 1.0 / (weights**2).sum(axis=1) / _SWEEPS
    return GroupDraws(kept_means, kept_spreads, kept, effective)


def describe_groups(
    free: Sequence[FreeParameter], people: Sequence[str], groups: Sequence[str], drawn: GroupDraws
) -> dict[str, Any]:
    """Describes groups in the units of the parameters with 90 % intervals, for fit.json.

    Returns: Dictionary with ``groups``, the median of each parameter in each group; ``spread``, the SD between
        participants of the logarithm (logit for fractions); ``ratios``, the ratio between two groups (odds ratio for
        fractions) and the probability that it is above 1; ``people``, the parameters of each participant given the
        groups; and ``effective_draws``, the effective number of draws for each participant.
    """
    names = list(dict.fromkeys(groups))
    medians = {
        name: {each.name: _summarise(each.convert(drawn.means[:, g, p])) for p, each in enumerate(free)}
        for g, name in enumerate(names)
    }
    ratios: dict[str, Any] = {}
    for (g, one), (h, other) in itertools.combinations(enumerate(names), 2):
        logs = {each.name: each.sd * (drawn.means[:, h, p] - drawn.means[:, g, p]) for p, each in enumerate(free)}
        ratios[f"{other} / {one}"] = {
            name: {"ratio": _summarise(np.exp(log)), "probability_above_1": float((log > 0.0).mean())}
            for name, log in logs.items()
        }
    own = {
        person: {each.name: _summarise(each.convert(drawn.people[:, i, p])) for p, each in enumerate(free)}
        for i, person in enumerate(people)
    }
    spread = {each.name: _summarise(each.sd * drawn.spreads[:, p]) for p, each in enumerate(free)}
    effective = dict(zip(people, drawn.effective.tolist(), strict=True))
    return {"groups": medians, "spread": spread, "ratios": ratios, "people": own, "effective_draws": effective}


def list_groups(description: dict[str, Any]) -> list[str]:
    """Formats the description of groups as text."""
    lines = []
    for name, values in description["groups"].items():
        lines.append(f"group {name}: " + ", ".join(f"{key} {_show(value)}" for key, value in values.items()))
    spread = ", ".join(f"{key} {_show(value)}" for key, value in description["spread"].items())
    lines.append(f"SD of the logarithm between people (logit, of a fraction): {spread}")
    for pair, values in description["ratios"].items():
        cells = [
            f"{key} {_show(each['ratio'])}, above 1 with probability {each['probability_above_1']:.2f}"
            for key, each in values.items()
        ]
        lines.append(f"ratio {pair}: {'; '.join(cells)}")
    few = [name for name, count in description["effective_draws"].items() if count < _FEW]
    if few:
        lines.append(
            f"warning: groups are not to be relied on: fewer than {_FEW:g} effective draws of {', '.join(few)}: "
            "use more --draws"
        )
    return lines


def _summarise(values: Array) -> list[float]:
    """Computes the median and the 5 % and 95 % quantiles."""
    return [float(each) for each in np.quantile(values, [0.5, 0.05, 0.95])]


def _show(value: Sequence[float]) -> str:
    return f"{value[0]:.3g} [{value[1]:.3g}, {value[2]:.3g}]"
