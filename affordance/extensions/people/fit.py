"""Fits of learners to the lifts of participants, separately or pooled.

Results are xarray DataTrees in the format of ArviZ 1.
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

# Groups of a fit, and their axes.
GROUPS = {
    "posterior": {"chain", "draw"},
    "prior": {"chain", "draw"},
    "log_likelihood": {"chain", "draw", "participant", "trial"},
    "observed_data": {"participant", "trial"},
    "sample_stats": {"chain", "stage"},
}
# Limits on memory and run time (SECURITY.md): rows of arrays; numbers in an array of joint covariances, which has up
# to one kind per object; and rows times lifts in one evaluation of the likelihood.
_MOST_ROWS, _MOST_NUMBERS, _MOST_WORK = 100_000, 100_000_000, 200_000_000
_NOISE_REPEATS = 6
# Grid of the free parameters of a learner: spacing in SDs of the prior, largest number of nodes on each side of the
# median, and largest number of parameters. With more parameters, the grid would be larger than the number of draws.
_STEP, _MOST_STEPS, _MOST_ON_GRID = 0.5, 6, 2
# Largest acceptable SD of an estimated log likelihood between random streams of the particle filter. About 0.9 is
# recommended for samplers with estimated likelihoods (Pitt and others 2012, J. Econometrics 171:134-151).
MOST_NOISE = 1.0
_MOST_PARTICLES = 800  # largest number of particles for participants with a larger SD


@dataclass(frozen=True)
class Question:
    """Specification of a fit: lifts, learner, free parameters and sampler settings.

    Attributes:
        lifts: Lifts of participants.
        learner: Fitted learner.
        settings: All other settings.
        free: Free parameters.
        draws: Number of posterior draws.
        particles: Number of particles for each draw.
        moves: Number of random-walk steps after each stage of the sampler.
        seed: Seed of all random numbers.
        jobs: Number of processes among which participants are divided.
        chains: Number of independent samplers.
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
    # Cache of particle trajectories by participant, grid node, and number of the random stream.
    _kept: dict[tuple[int, ...], Courses] = field(
        default_factory=dict, init=False, repr=False, metadata={"reports": True}
    )

    def __post_init__(self) -> None:
        """Checks memory and run time. A BadValueError is raised if the fit would take too much."""
        if self.draws * self.particles > self.most_rows:
            most = self.most_rows // self.particles
            problem = f"is {self.draws}, must be at most {most} with {self.particles} particles and these lifts"
            raise BadValueError("--draws", "", problem)

    @cached_property
    def most_rows(self) -> int:
        """Largest product of draws and particles for these lifts. Objects that look the same count as one object."""
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
        """Computes log likelihoods of a participant's N pushes for D draws, (D, N)."""
        return self.filter(place, normal, repeats).log_density

    def filter(self, place: int, normal: Array, repeats: Sequence[int] = ()) -> Filtered:
        """Computes one-step-ahead log likelihoods and means of a participant's N pushes for D draws.

        If the learner has at most two free parameters, particles are simulated on a grid of parameter values, and
        results are interpolated.

        Args:
            place: Index of the participant.
            normal: Standard normal numbers of the free parameters, (D, F).
            repeats: Number of the random stream of each draw, (D,); 0 is the default stream of the fit.
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
        """Gets particle trajectories from the cache, or simulates them.

        Args:
            place: Index of the participant.
            nodes: Grid nodes, (D, F).
            numbers: Numbers of random streams, (D,).

        Returns: Trajectories for all different nodes and streams, and the index of each draw's trajectories, (D,).
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
        """Simulates particle trajectories for K parameter vectors of the learner, (K, F), and random streams."""
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
        """Computes log likelihoods of the pushes of all participants, (D, participants, N), padded with zeros."""
        tasks = [partial(self.compute, place, normal) for place in range(len(self.lifts.people))]
        jobs = 1 if self._kept else self.jobs  # sending cached trajectories takes longer than weighting them
        return stack(run_tasks(tasks, jobs=jobs, description="fit"))

    def estimate_noise(self, normal: Array) -> Array:
        """Estimates the Monte Carlo SD of the log likelihood of each participant, (participants,).

        Parameters of the learner are rounded to the nearest grid node if there is a grid.

        Args:
            normal: Standard normal numbers of each participant's free parameters, (participants, F).
        """
        tasks = [
            partial(self._repeat, place, np.tile(each, (_NOISE_REPEATS, 1))) for place, each in enumerate(normal)
        ]
        found = run_tasks(tasks, jobs=self.jobs, description="particle noise")
        return np.array([_find_noise(each) for each in found])

    def _repeat(self, place: int, normal: Array) -> Filtered:
        """Filters the pushes of a participant for six draws, (6, F), each with a separate random stream."""
        return self.filter(place, self._move_to_nodes(normal), range(1, _NOISE_REPEATS + 1))

    def _move_to_nodes(self, normal: Array) -> Array:
        """Rounds the learner's parameters of D draws, (D, F), to the nearest grid node if there is a grid."""
        (own, _), moved = split_free(self.free), normal.copy()
        if len(own) <= _MOST_ON_GRID:
            moved[:, own] = _STEP * np.rint(moved[:, own] / _STEP)
        return moved

    def average_streams(self, place: int, normal: Array) -> float:
        """Estimates a correction to the log evidence of a participant that averages over random streams.

        Averaged over the posterior for one stream, the likelihood ratio of another stream to this stream equals the
        ratio of their evidences. The average is estimated with six further streams, one posterior draw each.

        Args:
            place: Index of the participant.
            normal: Posterior draws, (D, F), in standard normal numbers.

        Returns: Log of the mean evidence of all streams minus the log evidence of the stream of the fit.
        """
        chosen = normal[np.arange(_NOISE_REPEATS) * len(normal) // _NOISE_REPEATS]
        others = self._repeat(place, chosen).log_density.sum(axis=1)
        ratios = others - self.compute(place, self._move_to_nodes(chosen)).sum(axis=1)
        return float(logsumexp([0.0, *ratios]) - np.log(1 + _NOISE_REPEATS))

    def draw_prior(self) -> Array:
        """Draws D vectors of free parameters from the prior, (D, F), in standard normal numbers."""
        return draw_prior(self.draws, len(self.free), self.seed)


def _find_noise(repeats: Filtered) -> float:
    return float(repeats.log_density.sum(axis=1).std(ddof=1))


def find_best(question: Question, found: Draws) -> Array:
    """Finds the most likely draw of a pooled fit, repeated for each participant, (participants, F)."""
    best = found.normal[found.log_likelihoods.reshape(len(found.normal), -1).sum(axis=1).argmax()]
    return np.tile(best, (len(question.lifts.people), 1))


def warn_of_noise(names: Sequence[str], noise: Sequence[float] | Array) -> list[str]:
    """Lists warnings about noisy log likelihoods, one per name."""
    pairs = zip(names, noise, strict=True)
    return [
        f"warning: {name}: not to be relied on; with other random numbers the log likelihood has an SD of {sd:.1f}, "
        f"must be at most {MOST_NOISE:g}, and a log score is up to {sd**2 / 2:.1f} too low: use more --particles"
        for name, sd in pairs
        if sd > MOST_NOISE
    ]


def stack(parts: Sequence[Array]) -> Array:
    """Stacks arrays of participants, (D, N) each, to (D, participants, N), padded with zeros."""
    longest = max(each.shape[1] for each in parts)
    return np.stack([np.pad(each, ((0, 0), (0, longest - each.shape[1]))) for each in parts], axis=1)


class PersonFit(NamedTuple):
    """Fit to one participant, with concatenated chains."""

    draws: Draws
    noise: float  # Monte Carlo SD of the log likelihood at the best draw
    particles: int
    predicted: Array  # one-step-ahead mean of each push at the best draw, averaged over random streams, (N,), [N]


def fit_each(question: Question, folder: Path | None = None) -> list[PersonFit]:
    """Samples the posterior of each participant separately.

    If the log likelihood of a participant is too noisy, the fit is repeated with four times as many particles, up to
    800.

    Args:
        question: Specification of the fit.
        folder: Folder for caching finished participants; None for no cache. Changed inputs invalidate the cache.
    """
    people, jobs = range(len(question.lifts.people)), question.jobs
    if folder is None:
        return run_tasks([partial(_fit_one, question, place) for place in people], jobs=jobs, description="fit")
    return [_read_arrays(**each) for each in _run_kept(question, folder, _list_arrays)]


def _run_kept(
    question: Question, folder: Path, run: Callable[[Question, int], dict[str, NDArray[Any]]]
) -> list[dict[str, NDArray[Any]]]:
    """Runs a function for each participant, and caches its results in the folder."""
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
    """Fits one participant, and returns the arrays for the cache by name."""
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
    """Samples the posterior of one participant, and averages the evidence over several random streams."""
    draws = sample(
        partial(question.compute, place),
        len(question.free),
        count=question.draws,
        moves=question.moves,
        seed=question.seed,
    )
    return draws._replace(log_evidence=draws.log_evidence + question.average_streams(place, draws.normal))


def fit_pooled(question: Question, folder: Path | None = None) -> Draws:
    """Samples the posterior of parameters that all participants share, with concatenated chains.

    Args:
        question: Specification of the fit.
        folder: Folder for caching particle trajectories; None for no cache. Changed inputs invalidate the cache.
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
    """Simulates a participant's particles at the grid nodes of prior draws, and returns the arrays for the cache."""
    question.compute(place, question.draw_prior())
    kept = {key[1:]: each for key, each in question._kept.items() if key[0] == place}
    joined = Courses(*map(np.concatenate, zip(*kept.values(), strict=True)))
    return {"nodes": np.array([*kept]), **joined._asdict()}


def _split_chains(question: Question) -> list[Question]:
    """Returns one specification per chain. The first chain has the original seed."""
    others = np.random.SeedSequence(question.seed).generate_state(question.chains - 1)
    return [replace(question, seed=seed, chains=1) for seed in (question.seed, *map(int, others))]


def describe_fit(question: Question, found: Draws | Sequence[Draws]) -> xr.DataTree:
    """Converts a fit to a tree of datasets with the group names of ArviZ.

    Args:
        question: Specification of the fit.
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
    """Stacks arrays, and pads the end of their last dimension with a value."""
    size = max(np.shape(each)[-1] for each in rows)
    return np.array([_lengthen(np.asarray(each, float), size, value) for each in rows])


def _lengthen(row: Array, size: int, value: float) -> Array:
    width = [(0, 0)] * (row.ndim - 1) + [(0, size - row.shape[-1])]
    return np.pad(row, width, constant_values=value)


def arrange_for_loo(tree: xr.DataTree, by: str = "participant") -> xr.DataTree:
    """Arranges log likelihoods without missing values for ``arviz.loo`` and ``arviz.compare``.

    Args:
        tree: Fit.
        by: Unit that is left out. For ``participant``, log likelihoods are summed over pushes, which makes sense only
            for pooled fits. For ``push``, each observed push has one entry; later pushes still depend on the
            measurement in the left-out lift.
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
    """Computes one-step-ahead log scores: log predictive densities given all previous pushes, (N,).

    Args:
        log_likelihoods: Log densities of N pushes for D draws, (D, N).
        log_weights: Unnormalised log prior weights of the draws, (D,); None for equal weights. Weights are updated
            with the likelihood of each push.
    """
    D = len(log_likelihoods)
    weights = np.full(D, -np.log(D)) if log_weights is None else log_weights - logsumexp(log_weights)
    before = np.cumsum(log_likelihoods, axis=1) - log_likelihoods
    joint = weights[:, None] + before
    scores: Array = logsumexp(joint + log_likelihoods, axis=0) - logsumexp(joint, axis=0)
    return scores


def leave_out(log_likelihoods: Array) -> tuple[Array, Array]:
    """Computes leave-one-out scores: log scores of each participant given all other participants.

    Posterior draws of the pooled fit are weighted by the inverse likelihood of the left-out participant.

    Args:
        log_likelihoods: Log densities of pushes under D pooled posterior draws, (D, participants, N).

    Returns:
        Log scores, (participants, N), and effective number of draws for each participant, (participants,).
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
    """Writes each group of a fit to a NetCDF file with the name of the group."""
    for name in GROUPS:
        dataset = tree[name].to_dataset()
        write_atomic(
            folder / f"{name}.nc",
            partial(_write, dataset.assign_attrs({key: str(value) for key, value in dataset.attrs.items()})),
        )


def _write(dataset: xr.Dataset, path: Path) -> None:
    dataset.to_netcdf(path, engine="scipy", format="NETCDF3_64BIT")


def read_fit(folder: Path) -> xr.DataTree:
    """Reads a fit that ``write_fit`` wrote. A damaged file raises a BadValueError."""
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
    """Computes posterior mean, 5 % and 95 % quantile of each free parameter."""
    values = question.convert(draws.normal)
    return {
        name: [float(column.mean()), *np.quantile(column, [0.05, 0.95]).tolist()]
        for name, column in zip(question.names, values.T, strict=True)
    }


class Comparison(NamedTuple):
    """Comparison of learners. Keys of mappings are names of learners.

    Attributes:
        participants: Names of the participants.
        fits: Fit of the learner to each participant.
        scores: Log evidence, which equals the sum of one-step-ahead log scores, (participants,).
        bic: Bayesian information criterion at the most likely draw, (participants,).
        selection: Estimated frequencies of the learners, in the order of ``scores``.
    """

    participants: list[str]
    fits: Mapping[str, list[PersonFit]]
    scores: Mapping[str, Array]
    bic: Mapping[str, Array]
    selection: Selection

    def find_best(self, by: str = "scores") -> list[str]:
        """Finds the best learner for each participant according to ``scores`` or ``bic``."""
        names = [*self.scores]
        values = [self.scores[name] if by == "scores" else -self.bic[name] for name in names]
        return [names[place] for place in np.argmax(values, axis=0)]

    def tabulate(self) -> pd.DataFrame:
        """Tabulates scores by participant and learner, relative to the best learner."""
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
    """Compares learners on the same lifts.

    Args:
        questions: Specification of the fit of each learner.
        folder: Folder for caching fits, as in ``fit_each``.
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
