"""Fits a learner to people's lifts, separately or pooled; returns an xarray DataTree that ArviZ 1 can read."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from scipy.special import logsumexp

from affordance.arrays import Array, about
from affordance.belief.learner import Learner
from affordance.exceptions import BadValueError, describe_choice
from affordance.extensions.people.likelihood import FreeParameter, compute_log_likelihoods
from affordance.extensions.people.pushes import Lifts
from affordance.extensions.people.tempered_smc import Draws, draw_prior, merge, sample
from affordance.files.atomic import write_atomic
from affordance.files.bounded import RESULTS, read_bytes
from affordance.runs.repeats import run_tasks
from affordance.settings import Settings
from affordance.version import __version__

# Groups of a fit, and the axes that each has.
GROUPS = {
    "posterior": {"chain", "draw"},
    "prior": {"chain", "draw"},
    "log_likelihood": {"chain", "draw", "participant", "trial"},
    "observed_data": {"participant", "trial"},
    "sample_stats": {"chain", "stage"},
}
# Limits of memory and time (SECURITY.md): rows of arrays; numbers in one array, which holds the joint covariance of
# up to one kind for each object; and rows times lifts in one evaluation of a likelihood.
_MOST_ROWS, _MOST_NUMBERS, _MOST_WORK = 100_000, 100_000_000, 200_000_000
_NOISE_REPEATS = 6
# Largest SD of a log likelihood over the random numbers of particles with which a fit can be relied on; about 0.9 is
# recommended for samplers with estimated likelihoods (Pitt and others 2012, J. Econometrics 171:134-151).
MOST_NOISE = 1.0


@dataclass(frozen=True)
class Question:
    """Lifts, learner and free parameters of a fit, with the settings of the sampler.

    Attributes:
        lifts: Lifts of participants.
        learner: Learner that is fitted.
        settings: All other settings.
        free: Free parameters.
        draws: Number of posterior draws.
        particles: Number of particles for each draw.
        moves: Random-walk steps after each stage of the sampler.
        seed: Seed of all random numbers.
        jobs: Number of processes, which share the participants.
        chains: Number of independent samplers, each with its own draws and particles.
    """

    lifts: Lifts
    learner: Learner
    settings: Settings
    free: Sequence[FreeParameter]
    draws: int = 64
    particles: int = 50
    moves: int = 2
    seed: int = 0
    jobs: int = 1
    chains: int = 1

    def __post_init__(self) -> None:
        """Raises a BadValueError if the fit would take too much memory or time."""
        rows = self.draws * self.particles
        lifts = max(len(each.objects) for each in self.lifts.people)
        most_rows = min(_MOST_ROWS, _MOST_NUMBERS // len(self.lifts.tools) ** 2, _MOST_WORK // lifts)
        if rows > most_rows:
            most = most_rows // self.particles
            problem = f"is {self.draws}, must be at most {most} with {self.particles} particles and these lifts"
            raise BadValueError("--draws", "", problem)

    @property
    def names(self) -> list[str]:
        """Names of the free parameters."""
        return [each.name for each in self.free]

    def convert(self, normal: Array) -> Array:
        """Converts standard normal numbers, (D, F), to values of the free parameters, (D, F)."""
        return np.column_stack([each.convert(normal[:, column]) for column, each in enumerate(self.free)])

    def compute(self, place: int, normal: Array, repeat: int = 0) -> Array:
        """Computes log likelihoods of one participant's N pushes for D draws, both (D, ...); returns (D, N).

        Each ``repeat`` has other random numbers; 0 are those of the fit.
        """
        return compute_log_likelihoods(
            self.lifts.people[place],
            self.lifts.tools,
            self.learner,
            self.settings,
            self.free,
            self.convert(normal),
            particles=self.particles,
            seed=(self.seed, place, repeat) if repeat else (self.seed, place),
        )

    def compute_all(self, normal: Array) -> Array:
        """Computes log likelihoods of all pushes, (D, participants, N), padded with zeros."""
        tasks = [partial(self.compute, place, normal) for place in range(len(self.lifts.people))]
        return stack(run_tasks(tasks, jobs=self.jobs, description="fit"))

    def estimate_noise(self, normal: Array) -> Array:
        """Estimates the SD of each participant's log likelihood over the particles' random numbers, (participants,).

        Args:
            normal: Standard normal numbers of each participant's free parameters, (participants, F).
        """
        repeats = range(1, _NOISE_REPEATS + 1)
        tasks = [partial(self.compute, place, normal[[place]], k) for place in range(len(normal)) for k in repeats]
        found = [parts.sum() for parts in run_tasks(tasks, jobs=self.jobs, description="particle noise")]
        noise: Array = np.reshape(found, (len(normal), _NOISE_REPEATS)).std(axis=1, ddof=1)
        return noise

    def draw_prior(self) -> Array:
        """Draws standard normal numbers for the free parameters from the prior, (D, F)."""
        return draw_prior(self.draws, len(self.free), self.seed)


def find_best(question: Question, found: Draws | Sequence[Draws]) -> Array:
    """Finds the most probable draw for each participant, (participants, F), in standard normal numbers."""
    each = [found] * len(question.lifts.people) if isinstance(found, Draws) else found
    return np.array(
        [one.normal[one.log_likelihoods.reshape(len(one.normal), -1).sum(axis=1).argmax()] for one in each]
    )


def warn_of_noise(names: Sequence[str], noise: Array) -> list[str]:
    """Returns a warning for each name whose log likelihood is too noisy."""
    pairs = zip(names, noise.tolist(), strict=True)
    return [
        f"warning: {name}: not to be relied on; with other random numbers the log likelihood has an SD of {sd:.1f}, "
        f"must be at most {MOST_NOISE:g}: use more --particles"
        for name, sd in pairs
        if sd > MOST_NOISE
    ]


def stack(parts: Sequence[Array]) -> Array:
    """Stacks participants' arrays, (D, N) each, to (D, participants, N), padded with zeros."""
    longest = max(each.shape[1] for each in parts)
    return np.stack([np.pad(each, ((0, 0), (0, longest - each.shape[1]))) for each in parts], axis=1)


def fit_each(question: Question) -> list[Draws]:
    """Draws from the posterior of each participant separately, with all chains concatenated."""
    chains = _split_chains(question)
    people = range(len(question.lifts.people))
    tasks = [partial(_fit_one, chain, place) for place in people for chain in chains]
    found = run_tasks(tasks, jobs=question.jobs, description="fit")
    return [merge(found[len(chains) * place : len(chains) * (place + 1)]) for place in people]


def _fit_one(question: Question, place: int) -> Draws:
    options = {"count": question.draws, "moves": question.moves, "seed": question.seed}
    return sample(partial(question.compute, place), len(question.free), **options)


def fit_pooled(question: Question) -> Draws:
    """Draws from the posterior of parameters shared by all participants, with all chains concatenated."""
    return merge(
        [
            sample(chain.compute_all, len(chain.free), count=chain.draws, moves=chain.moves, seed=chain.seed)
            for chain in _split_chains(question)
        ]
    )


def _split_chains(question: Question) -> list[Question]:
    """Returns one question for each chain; the first chain has the original seed."""
    others = np.random.SeedSequence(question.seed).generate_state(question.chains - 1)
    return [replace(question, seed=seed, chains=1) for seed in (question.seed, *map(int, others))]


def describe_fit(question: Question, found: Draws | Sequence[Draws]) -> xr.DataTree:
    """Builds a tree of datasets from a fit, with the group names of ArviZ.

    Args:
        question: Question that was fitted.
        found: Draws of a pooled fit, or a list with the draws of each participant.

    Returns:
        Groups ``posterior`` (chain, draw) or (chain, draw, participant), ``prior`` (chain, draw), ``log_likelihood``
        (chain, draw, participant, trial), ``observed_data`` (participant, trial), and ``sample_stats``.
    """
    people, size = question.lifts.people, (question.chains, question.draws)
    is_pooled = isinstance(found, Draws)
    each = [found] if isinstance(found, Draws) else list(found)
    parts = found.log_likelihoods if isinstance(found, Draws) else stack([one.log_likelihoods for one in each])
    observed = _pad([person.pushes for person in people], np.nan)
    draws = {"chain": np.arange(size[0]), "draw": np.arange(size[1])}
    names = {"participant": [person.name for person in people], "trial": np.arange(1, observed.shape[1] + 1)}
    values = np.stack([question.convert(one.normal) for one in each], axis=1).reshape(*size, len(each), -1)
    before = question.convert(each[0].prior_normal).reshape(*size, -1)
    axes = ("chain", "draw", "participant")
    posterior = {
        name: (axes[:2], values[:, :, 0, column]) if is_pooled else (axes, values[..., column])
        for column, name in enumerate(question.names)
    }
    prior = {name: (axes[:2], before[..., column]) for column, name in enumerate(question.names)}
    powers, rates = ([getattr(one, name) for one in each] for name in ("powers", "acceptance"))
    statistics = {
        "power": (("fit", "chain", "stage"), _pad(powers, np.nan), about("1", "of likelihood")),
        "acceptance_rate": (("fit", "chain", "stage"), _pad(rates, np.nan), about("1", "")),
        "log_evidence": ("fit", [one.log_evidence for one in each], about("1", "log marginal likelihood")),
    }
    likely = np.where(np.isfinite(observed), parts, np.nan).reshape(*size, *observed.shape)
    tree = {
        "posterior": xr.Dataset(posterior, draws if is_pooled else {**draws, "participant": names["participant"]}),
        "prior": xr.Dataset(prior, draws),
        "log_likelihood": xr.Dataset({"push": ((*axes, "trial"), likely)}, {**draws, **names}),
        "observed_data": xr.Dataset({"push": (("participant", "trial"), observed, about("N", "push"))}, names),
        "sample_stats": xr.Dataset(statistics, {"chain": draws["chain"]}),
    }
    about_it = {"learner": question.learner.name, "particles": question.particles, "seed": question.seed}
    made_by = {"inference_library": "visual-inertial-affordances", "inference_library_version": __version__}
    return xr.DataTree.from_dict({name: group.assign_attrs(about_it, **made_by) for name, group in tree.items()})


def _pad(rows: Sequence[Array], value: float) -> Array:
    """Stacks arrays after padding each with a value at the end of its last dimension."""
    size = max(np.shape(each)[-1] for each in rows)
    return np.array([_lengthen(np.asarray(each, float), size, value) for each in rows])


def _lengthen(row: Array, size: int, value: float) -> Array:
    width = [(0, 0)] * (row.ndim - 1) + [(0, size - row.shape[-1])]
    return np.pad(row, width, constant_values=value)


def arrange_for_loo(tree: xr.DataTree, by: str = "participant") -> xr.DataTree:
    """Rearranges a fit's log likelihood for ``arviz.loo`` and ``arviz.compare``, which reject missing values.

    Args:
        tree: Fit.
        by: ``participant`` sums over each participant's pushes, so that whole participants are left out; this makes
            sense for a pooled fit only. ``push`` has one entry for each observed push; later pushes are still
            predicted from what was felt in the lift that is left out.
    """
    if by not in ("participant", "push"):
        raise BadValueError("arrange_for_loo", "by", describe_choice(by, ("participant", "push")))
    each = tree["log_likelihood"].to_dataset()
    if by == "participant":
        arranged = each.sum("trial")
    else:
        arranged = each.stack(number=("participant", "trial")).dropna("number").reset_index("number")
    return xr.DataTree.from_dict(
        {name: group.to_dataset() for name, group in tree.children.items()} | {"log_likelihood": arranged}
    )


def score_ahead(log_likelihoods: Array, log_weights: Array | None = None) -> Array:
    """Computes the log score of each push, one step ahead, (N,): its log density given all pushes before it.

    Args:
        log_likelihoods: Log densities of N pushes for D draws, (D, N).
        log_weights: Log prior weights of the draws, (D,), not necessarily normalised; None if equal. Each draw is
            also weighted by its likelihood of the pushes before.
    """
    D = len(log_likelihoods)
    weights = np.full(D, -np.log(D)) if log_weights is None else log_weights - logsumexp(log_weights)
    before = np.cumsum(log_likelihoods, axis=1) - log_likelihoods
    joint = weights[:, None] + before
    scores: Array = logsumexp(joint + log_likelihoods, axis=0) - logsumexp(joint, axis=0)
    return scores


def leave_out(log_likelihoods: Array) -> tuple[Array, Array]:
    """Scores the pushes of each participant one step ahead, under the posterior given all others.

    Pooled posterior draws are weighted by the inverse of their likelihood for the participant that is left out.

    Args:
        log_likelihoods: Log densities of pushes under D pooled posterior draws, (D, participants, N).

    Returns:
        Log scores, (participants, N), and the effective number of draws for each participant, (participants,).
    """
    totals = log_likelihoods.sum(axis=2)
    scores, effective = [], []
    for place in range(totals.shape[1]):
        weights = -totals[:, place]
        normalised = np.exp(weights - logsumexp(weights))
        effective.append(1.0 / (normalised**2).sum())
        scores.append(score_ahead(log_likelihoods[:, place], weights))
    return np.array(scores), np.array(effective)


def write_fit(tree: xr.DataTree, folder: Path) -> None:
    """Writes each group of a fit to a NetCDF file with the group's name; needs no further library."""
    for name in GROUPS:
        dataset = tree[name].to_dataset()
        write_atomic(
            folder / f"{name}.nc",
            partial(_write, dataset.assign_attrs({key: str(value) for key, value in dataset.attrs.items()})),
        )


def _write(dataset: xr.Dataset, path: Path) -> None:
    dataset.to_netcdf(path, engine="scipy", format="NETCDF3_64BIT")


def read_fit(folder: Path) -> xr.DataTree:
    """Reads a fit that ``write_fit`` wrote, as a tree for ArviZ; a damaged file raises a BadValueError."""
    return xr.DataTree.from_dict({name: _read(folder / f"{name}.nc", name) for name in GROUPS})


def _read(path: Path, name: str) -> xr.Dataset:
    content, problem = read_bytes(path, RESULTS), f"is damaged, must hold the group {name} of a fit: fit again"
    try:
        dataset = xr.load_dataset(io.BytesIO(content), engine="scipy")
    except (OSError, ValueError, TypeError, LookupError, AttributeError) as error:
        raise BadValueError(path, "", problem) from error
    if GROUPS[name] - set(dataset.dims) or any(each.dtype.kind not in "fi" for each in dataset.data_vars.values()):
        raise BadValueError(path, "", problem)
    return dataset


def describe_values(question: Question, draws: Draws) -> dict[str, list[float]]:
    """Returns posterior mean, and 5 % and 95 % quantiles, of each free parameter."""
    values = question.convert(draws.normal)
    return {
        name: [float(column.mean()), *np.quantile(column, [0.05, 0.95]).tolist()]
        for name, column in zip(question.names, values.T, strict=True)
    }


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
