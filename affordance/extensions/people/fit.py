"""Fits a learner to people's lifts, separately or pooled.

The result is an xarray DataTree for ArviZ 1.
"""

import io
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray
from scipy.special import logsumexp

from affordance.arrays import Array, about
from affordance.belief.learner import Learner
from affordance.exceptions import BadValueError, describe_choice
from affordance.extensions.people.likelihood import (
    Courses,
    Filtered,
    FreeParameter,
    draw_courses,
    filter_pushes,
    split_free,
)
from affordance.extensions.people.participant import with_participant
from affordance.extensions.people.pushes import Lifts
from affordance.extensions.people.selection import Selection, select_learners
from affordance.extensions.people.static_lifts import StaticLifter
from affordance.extensions.people.tempered_smc import Draws, draw_prior, merge, sample
from affordance.files.atomic import write_atomic
from affordance.files.bounded import RESULTS, read_bytes
from affordance.files.model_files import list_arm_files
from affordance.runs.repeats import compute_key, run_batches, run_each, run_tasks
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
# Nodes of the grid of a learner's free parameters, in SDs of their priors, their largest number on each side, and the
# largest number of parameters with a grid; of more, a grid would have more values than there are draws.
_STEP, _MOST_STEPS, _MOST_ON_GRID = 0.5, 6, 2
# Largest SD of a log likelihood over the random numbers of particles with which a fit can be relied on; about 0.9 is
# recommended for samplers with estimated likelihoods (Pitt and others 2012, J. Econometrics 171:134-151).
MOST_NOISE = 1.0
_MOST_PARTICLES = 800  # for participants whose noise is larger


@dataclass(frozen=True)
class Question:
    """Problem of a fit: lifts, learner, free parameters and sampler settings.

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
    jobs: int = field(default=1, metadata={"reports": True})
    chains: int = 1
    # Courses that were drawn, by participant, node of the grid, and number of the random stream.
    _kept: dict[tuple[int, ...], Courses] = field(
        default_factory=dict, init=False, repr=False, metadata={"reports": True}
    )

    def __post_init__(self) -> None:
        """Checks that the fit does not take too much memory or time. Otherwise a BadValueError is raised."""
        if self.draws * self.particles > self.most_rows:
            most = self.most_rows // self.particles
            problem = f"is {self.draws}, must be at most {most} with {self.particles} particles and these lifts"
            raise BadValueError("--draws", "", problem)

    @cached_property
    def most_rows(self) -> int:
        """Largest product of draws and particles. Objects that look the same count as one."""
        lifter, people = StaticLifter(self.lifts.tools, self.settings), self.lifts.people
        things = max(len(np.unique(lifter.identify_all(each.objects, each.teaches))) for each in people)
        lifts = max(len(each.objects) for each in people)
        return min(_MOST_ROWS, _MOST_NUMBERS // things**2, _MOST_WORK // lifts)

    @property
    def names(self) -> list[str]:
        """Names of the free parameters."""
        return [each.name for each in self.free]

    def convert(self, normal: Array) -> Array:
        """Converts standard normal numbers to values of the free parameters, (D, F) each."""
        return np.column_stack([each.convert(normal[:, column]) for column, each in enumerate(self.free)])

    def compute(self, place: int, normal: Array, repeats: Sequence[int] = ()) -> Array:
        """Computes log likelihoods of one participant's N pushes for D draws, (D, N)."""
        return self.filter(place, normal, repeats).log_density

    def filter(self, place: int, normal: Array, repeats: Sequence[int] = ()) -> Filtered:
        """Computes log likelihoods and predicted means of one participant's N pushes.

        Means are one step ahead; there are D draws, (D, ...).

        If the learner has one or two free parameters, courses are drawn on a grid of their values, and results are
        interpolated. Draws with different ``repeats``, (D,), have different random numbers; 0, the default, has the
        fit's.
        """
        (own, pushed), numbers = split_free(self.free), np.array(repeats or [0] * len(normal))
        participant, free = with_participant(self.settings).participant, [self.free[i] for i in pushed]
        values, person = self.convert(normal)[:, pushed], self.lifts.people[place]
        if len(own) > _MOST_ON_GRID:
            courses = self._draw_courses(place, normal[:, own], numbers)
            return filter_pushes(person, courses, np.arange(len(normal)), participant, free, values)
        at = np.clip(normal[:, own] / _STEP, -_MOST_STEPS, _MOST_STEPS)
        low = np.floor(at).astype(int)
        total = np.zeros((2, len(normal), len(person.pushes)))
        corners = np.array(list(itertools.product((0, 1), repeat=len(own))), dtype=int)
        shares = [np.where(corner, at - low, 1.0 - at + low).prod(axis=1) for corner in corners]
        nodes = np.concatenate(
            [np.where(share[:, None] > 0.0, low + corner, low) for corner, share in zip(corners, shares, strict=True)]
        )
        courses, places = self._find_courses(place, nodes, np.tile(numbers, len(corners)))
        for share, each in zip(shares, np.split(places, len(corners)), strict=True):
            if share.any():
                total += share[:, None] * np.array(filter_pushes(person, courses, each, participant, free, values))
        return Filtered(*total)

    def _find_courses(
        self, place: int, nodes: NDArray[np.intp], numbers: NDArray[np.intp]
    ) -> tuple[Courses, NDArray[np.intp]]:
        """Finds courses for grid nodes, (D, F), and numbers of random streams, (D,).

        The courses come from the cache or are drawn now.

        Returns: Courses, and which of them each of the D has, (D,).
        """
        wanted, places = np.unique(np.column_stack([nodes, numbers]), axis=0, return_inverse=True)
        keys = [(place, *each) for each in wanted.tolist()]
        is_new = np.array([key not in self._kept for key in keys])
        if is_new.any():
            normal: Array = _STEP * wanted[is_new, :-1].astype(float)
            drawn = self._draw_courses(place, normal, wanted[is_new, -1])
            new = [key for key, it in zip(keys, is_new, strict=True) if it]
            self._kept.update({key: drawn.take(np.array([i])) for i, key in enumerate(new)})
        return Courses(*map(np.concatenate, zip(*(self._kept[key] for key in keys), strict=True))), places.ravel()

    def _draw_courses(self, place: int, normal: Array, numbers: NDArray[np.intp]) -> Courses:
        """Draws courses for K values of the learner's parameters, (K, F).

        ``numbers``, (K,), select random streams.
        """
        own = [self.free[i] for i in split_free(self.free)[0]]
        values = [each.convert(column) for each, column in zip(own, normal.T, strict=True)]
        return draw_courses(
            self.lifts.people[place],
            self.lifts.tools,
            self.learner,
            self.settings,
            self.free,
            np.array(values).reshape(len(own), len(normal)).T,
            particles=self.particles,
            seeds=[(self.seed, place, number) if number else (self.seed, place) for number in numbers.tolist()],
        )

    def compute_all(self, normal: Array) -> Array:
        """Computes log likelihoods of all pushes, (D, participants, N), padded with zeros."""
        tasks = [partial(self.compute, place, normal) for place in range(len(self.lifts.people))]
        jobs = 1 if self._kept else self.jobs  # courses take long to draw or to send, but not to weight
        return stack(run_tasks(tasks, jobs=jobs, description="fit"))

    def estimate_noise(self, normal: Array) -> Array:
        """Estimates the SD of each participant's log likelihood, (participants,).

        The noise comes from the particles' random numbers.

        The learner's parameters are taken at the nearest node of their grid, if there is one.

        Args:
            normal: Standard normal numbers of each participant's free parameters, (participants, F).
        """
        tasks = [
            partial(self._repeat, place, np.tile(each, (_NOISE_REPEATS, 1))) for place, each in enumerate(normal)
        ]
        found = run_tasks(tasks, jobs=self.jobs, description="particle noise")
        return np.array([_find_noise(each) for each in found])

    def _repeat(self, place: int, normal: Array) -> Filtered:
        """Filters a participant's pushes for several draws, (6, F), each with a random stream of its own."""
        return self.filter(place, self._move_to_nodes(normal), range(1, _NOISE_REPEATS + 1))

    def _move_to_nodes(self, normal: Array) -> Array:
        """Moves the learner's parameters of draws, (D, F), to the nearest node of their grid, if there is one."""
        (own, _), moved = split_free(self.free), normal.copy()
        if len(own) <= _MOST_ON_GRID:
            moved[:, own] = _STEP * np.rint(moved[:, own] / _STEP)
        return moved

    def average_streams(self, place: int, normal: Array) -> float:
        """Estimates the log of a participant's mean likelihood over random streams, relative to the fit's stream.

        Each of six further streams has one of the D posterior draws, (D, F). The mean over these of the ratio of the
        likelihoods of two streams is the ratio of their evidences, whose expectation is the evidence itself.
        """
        chosen = normal[np.arange(_NOISE_REPEATS) * len(normal) // _NOISE_REPEATS]
        others = self._repeat(place, chosen).log_density.sum(axis=1)
        ratios = others - self.compute(place, self._move_to_nodes(chosen)).sum(axis=1)
        return float(logsumexp([0.0, *ratios]) - np.log(1 + _NOISE_REPEATS))

    def draw_prior(self) -> Array:
        """Draws standard normal numbers for the free parameters, (D, F)."""
        return draw_prior(self.draws, len(self.free), self.seed)


def _find_noise(repeats: Filtered) -> float:
    return float(repeats.log_density.sum(axis=1).std(ddof=1))


def find_best(question: Question, found: Draws) -> Array:
    """Finds each participant's most probable draw of a pooled fit, (participants, F)."""
    best = found.normal[found.log_likelihoods.reshape(len(found.normal), -1).sum(axis=1).argmax()]
    return np.tile(best, (len(question.lifts.people), 1))


def warn_of_noise(names: Sequence[str], noise: Sequence[float] | Array) -> list[str]:
    """Returns a warning for each name with a noisy log likelihood."""
    pairs = zip(names, noise, strict=True)
    return [
        f"warning: {name}: not to be relied on; with other random numbers the log likelihood has an SD of {sd:.1f}, "
        f"must be at most {MOST_NOISE:g}, and a log score is up to {sd**2 / 2:.1f} too low: use more --particles"
        for name, sd in pairs
        if sd > MOST_NOISE
    ]


def stack(parts: Sequence[Array]) -> Array:
    """Stacks participants' arrays, (D, N) each, to (D, participants, N). Missing entries are zero."""
    longest = max(each.shape[1] for each in parts)
    return np.stack([np.pad(each, ((0, 0), (0, longest - each.shape[1]))) for each in parts], axis=1)


class PersonFit(NamedTuple):
    """Fit to one participant, with all chains concatenated."""

    draws: Draws
    noise: float  # SD of the log likelihood at the best draw over the particles' random numbers
    particles: int
    predicted: Array  # mean of each push one step ahead at the best draw, over these random numbers, (N,), [N]


def fit_each(question: Question, folder: Path | None = None) -> list[PersonFit]:
    """Draws from the posterior of each participant separately.

    Participants with too much noise are fitted again with four times as many particles, up to 800.

    Args:
        question: Question.
        folder: Folder that caches finished participants until an input changes; None for no cache.
    """
    people, jobs = range(len(question.lifts.people)), question.jobs
    if folder is None:
        return run_tasks([partial(_fit_one, question, place) for place in people], jobs=jobs, description="fit")
    return [_read_arrays(**each) for each in _run_kept(question, folder, _list_arrays)]


def _run_kept(
    question: Question, folder: Path, run: Callable[[Question, int], dict[str, NDArray[Any]]]
) -> list[dict[str, NDArray[Any]]]:
    """Runs a function for each participant. Finished participants are cached in the folder."""
    key = compute_key((question, run.__name__), list_arm_files(question.settings.arm), _fit_one, question.learner)
    return run_batches(
        folder / key,
        partial(run_each, partial(run, question)),
        repeats=len(question.lifts.people),
        jobs=question.jobs,
        description=f"fit {question.learner.name}",
        unit="person",
    )


def _list_arrays(question: Question, place: int) -> dict[str, NDArray[Any]]:
    """Fits one participant. Returns arrays by name, as stored in a file."""
    fit = _fit_one(question, place)
    numbers = {**fit.draws._asdict(), **{name: getattr(fit, name) for name in ("noise", "particles", "predicted")}}
    return {name: np.asarray(value) for name, value in numbers.items()}


def _read_arrays(*, noise: Array, particles: Array, predicted: Array, **draws: Any) -> PersonFit:
    draws["log_evidence"] = float(draws["log_evidence"])
    return PersonFit(Draws(**draws), float(noise), int(particles), predicted)


def _fit_one(question: Question, place: int) -> PersonFit:
    while True:
        questions = _split_chains(question)
        draws = merge([_draw(each, place) for each in questions])
        best = draws.normal[draws.log_likelihoods.sum(axis=1).argmax()]
        repeats = questions[0]._repeat(place, np.tile(best, (_NOISE_REPEATS, 1)))
        noise = _find_noise(repeats)
        particles = min(4 * question.particles, _MOST_PARTICLES)
        if noise <= MOST_NOISE or particles <= question.particles or particles * question.draws > question.most_rows:
            return PersonFit(draws, noise, question.particles, repeats.predicted.mean(axis=0))
        question = replace(question, particles=particles)


def _draw(question: Question, place: int) -> Draws:
    """Draws from the posterior of one participant. The evidence is the mean over several random streams."""
    draws = sample(
        partial(question.compute, place),
        len(question.free),
        count=question.draws,
        moves=question.moves,
        seed=question.seed,
    )
    return draws._replace(log_evidence=draws.log_evidence + question.average_streams(place, draws.normal))


def fit_pooled(question: Question, folder: Path | None = None) -> Draws:
    """Draws from the posterior of parameters that all participants share. All chains are concatenated.

    Args:
        question: Question.
        folder: Folder that caches the courses of each participant until an input changes; None for no cache.
    """
    chains = _split_chains(question)
    if folder is not None and len(split_free(question.free)[0]) <= _MOST_ON_GRID:
        for chain in chains:
            for place, arrays in enumerate(_run_kept(chain, folder, _list_courses)):
                nodes, courses = arrays.pop("nodes").tolist(), Courses(**arrays)
                chain._kept.update({(place, *node): courses.take(np.array([i])) for i, node in enumerate(nodes)})
    return merge(
        [
            sample(chain.compute_all, len(chain.free), count=chain.draws, moves=chain.moves, seed=chain.seed)
            for chain in chains
        ]
    )


def _list_courses(question: Question, place: int) -> dict[str, NDArray[Any]]:
    """Draws one participant's courses at the nodes of prior draws. Returns arrays by name, as stored in a file."""
    question.compute(place, question.draw_prior())
    kept = {key[1:]: each for key, each in question._kept.items() if key[0] == place}
    joined = Courses(*map(np.concatenate, zip(*kept.values(), strict=True)))
    return {"nodes": np.array([*kept]), **joined._asdict()}


def _split_chains(question: Question) -> list[Question]:
    """Returns one problem for each chain. The first chain has the original seed."""
    others = np.random.SeedSequence(question.seed).generate_state(question.chains - 1)
    return [replace(question, seed=seed, chains=1) for seed in (question.seed, *map(int, others))]


def describe_fit(question: Question, found: Draws | Sequence[Draws]) -> xr.DataTree:
    """Builds a tree of datasets from a fit, with ArviZ's names of groups.

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
    """Stacks arrays, padded with a value at the end of the last dimension."""
    size = max(np.shape(each)[-1] for each in rows)
    return np.array([_lengthen(np.asarray(each, float), size, value) for each in rows])


def _lengthen(row: Array, size: int, value: float) -> Array:
    width = [(0, 0)] * (row.ndim - 1) + [(0, size - row.shape[-1])]
    return np.pad(row, width, constant_values=value)


def arrange_for_loo(tree: xr.DataTree, by: str = "participant") -> xr.DataTree:
    """Rearranges a log likelihood for ``arviz.loo`` and ``arviz.compare``. Both reject missing values.

    Args:
        tree: Fit.
        by: ``participant`` sums over each participant's pushes, so that whole participants are left out; this makes
            sense for a pooled fit only. ``push`` has one entry for each observed push; later pushes are still
            predicted from the measurement in the left-out lift.
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
    """Computes the log score of each push one step ahead, (N,).

    The score is the log density given all pushes before it.

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
    """Computes each participant's one-step-ahead scores under the posterior of the others.

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
    """Writes each group of a fit to a NetCDF file with the group's name. No further library is needed."""
    for name in GROUPS:
        dataset = tree[name].to_dataset()
        write_atomic(
            folder / f"{name}.nc",
            partial(_write, dataset.assign_attrs({key: str(value) for key, value in dataset.attrs.items()})),
        )


def _write(dataset: xr.Dataset, path: Path) -> None:
    dataset.to_netcdf(path, engine="scipy", format="NETCDF3_64BIT")


def read_fit(folder: Path) -> xr.DataTree:
    """Reads a fit from ``write_fit`` as a tree for ArviZ. A damaged file raises a BadValueError."""
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
    """Computes posterior mean, and 5 % and 95 % quantiles, of each free parameter."""
    values = question.convert(draws.normal)
    return {
        name: [float(column.mean()), *np.quantile(column, [0.05, 0.95]).tolist()]
        for name, column in zip(question.names, values.T, strict=True)
    }


class Comparison(NamedTuple):
    """Result of a comparison of learners. Mappings have the learner's name as key.

    Attributes:
        participants: Names of the participants.
        fits: Fit of the learner to each participant.
        scores: Log evidence, which is the sum of the one-step-ahead log scores, (participants,).
        bic: Bayesian information criterion at the most probable draw, (participants,).
        selection: How frequent the learners are, in the order of ``scores``.
    """

    participants: list[str]
    fits: Mapping[str, list[PersonFit]]
    scores: Mapping[str, Array]
    bic: Mapping[str, Array]
    selection: Selection

    def find_best(self, by: str = "scores") -> list[str]:
        """Finds the best learner of each participant, by ``scores`` or ``bic``."""
        names = [*self.scores]
        values = [self.scores[name] if by == "scores" else -self.bic[name] for name in names]
        return [names[place] for place in np.argmax(values, axis=0)]

    def tabulate(self) -> pd.DataFrame:
        """Tabulates participants and learners, with differences from the best learner."""
        rows = []
        for place, participant in enumerate(self.participants):
            best = max(each[place] for each in self.scores.values())
            least = min(each[place] for each in self.bic.values())
            for column, name in enumerate(self.scores):
                score, bic, fit = self.scores[name][place], self.bic[name][place], self.fits[name][place]
                probability = self.selection.people[place, column]
                rows.append((participant, name, probability, score, score - best, bic, bic - least, fit.noise))
        columns = ["participant", "learner", "probability", "log_score", "behind_best", "bic", "above_best"]
        return pd.DataFrame(rows, columns=[*columns, "particle_noise"])


def compare(questions: Sequence[Question], folder: Path | None = None) -> Comparison:
    """Compares learners on the same lifts, with one problem per learner.

    ``folder`` caches fits, as in ``fit_each``.
    """
    lifts = questions[0].lifts
    counts = np.array([np.isfinite(person.pushes).sum() for person in lifts.people])
    fits = {question.learner.name: fit_each(question, folder) for question in questions}
    scores = {name: np.array([each.draws.log_evidence for each in found]) for name, found in fits.items()}
    bic = {
        question.learner.name: len(question.free) * np.log(counts)
        - 2.0 * np.array([each.draws.log_likelihoods.sum(axis=1).max() for each in fits[question.learner.name]])
        for question in questions
    }
    selection = select_learners(np.column_stack([*scores.values()]))
    return Comparison([person.name for person in lifts.people], fits, scores, bic, selection)
