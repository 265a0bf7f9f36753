"""Postures chosen one after the other for weighed objects, and the error of the mass after each.

A pool of postures is drawn from the thousand that were recorded with an object, and a rule chooses from it. Gains,
friction, errors and the model error are known from the other objects only. The mass is estimated as in
identification, except that the variance of errors comes from the calibration, because a few postures do not show it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.identification.evidence.evidence import Evidence
from affordance.identification.evidence.gains import Gains
from affordance.identification.evidence.joint_statistics import compute_statistics
from affordance.identification.evidence.payload_likelihood import ChannelPrior, PayloadLikelihood, factor
from affordance.identification.posterior.body_posterior import Mode, find_mode
from affordance.identification.posterior.log_cholesky import compute_jacobian, parameters_from_theta
from affordance.identification.posterior.payload_fit import build_channel_prior
from affordance.identification.posterior.solid_prior import SolidPrior
from affordance.identification.settings import IdentificationSettings
from studies.recorded.clones import LBIPE_OBJECTS, load_weighed_objects
from studies.recorded.peers import TO_90
from studies.recorded.weighed_objects import SERVO_PRIOR, calibrate_by_others

RULES = ("stated", "stated_at_once", "random", "condition", "d_optimal")
# Numbers of postures after which the mass is estimated, and size of a pool.
NUMBERS = (1, 2, 3, 4, 5, 6, 8, 12, 16, 20)
_POOL = 150
_REFERENCE, _MOST = 8, 5  # number of random postures, and largest number of chosen postures that should be as good
_SEEN = 4  # mass and first moments, which are all that postures at rest show


@dataclass(frozen=True)
class PosewiseConfig:
    """Configuration of the pools of one object."""

    data: str  # folder of the recordings
    name: str  # name of the object
    rule: str  # name of the rule
    seed: int = 0  # seed of the pools, which are the same for all rules
    numbers: tuple[int, ...] = NUMBERS  # numbers of postures after which the mass is estimated


class Task(NamedTuple):
    """Object, with everything that is known before its postures are chosen."""

    evidence: Evidence  # evidence of all postures, with the load signs of the expected body
    gains: Gains  # gains, drift included
    prior: ChannelPrior  # prior of all unknowns except the payload
    theta: Array  # Log-Cholesky coordinates of the expected body, shape (10,)

    def expect(self, theta: Array) -> "Task":
        """Returns the task with another expected body, shape (10,)."""
        evidence = self.evidence.with_load(parameters_from_theta(theta))
        return self._replace(theta=theta, evidence=evidence)

    def build_rows(self) -> Array:
        """Builds the derivatives of the signals with respect to the unknowns, (postures, joints, 9).

        The unknowns are mass, first moments, gains and friction.

        Rows and columns are scaled so that errors, and the prior of gains and friction, have a standard deviation of
        one.
        """
        samples, gains, prior = self.evidence.samples, self.gains, self.prior
        s, Y = samples.load_sign[..., None], samples.Y[..., :_SEEN]
        torque = (samples.tau_arm + samples.Y @ parameters_from_theta(self.theta))[..., None]
        by_load = (gains.mean[:, :1] + gains.mean[:, 1:] * s) * Y
        by_gains = np.einsum("njk,jkl->njl", np.concatenate([torque, s * torque], axis=2), factor(gains.covariance))
        ones = np.ones_like(samples.direction)
        by_friction = np.stack([samples.direction, samples.velocity, ones], axis=2) * prior.friction_sd
        rows = np.concatenate([by_load, by_gains, by_friction], axis=2)
        return rows / np.sqrt(gains.least_variance)[:, None]

    def predict(self, sums: Array) -> Array:
        """Predicts the SD of the log mass, ln m, that identification would state, shape (M,).

        Args:
            sums: Sums of outer products of rows for M sets of postures, (M, joints, 9, 9).
        """
        B = sums[..., :_SEEN, _SEEN:]
        others = np.eye(sums.shape[-1] - _SEEN) + sums[..., _SEEN:, _SEEN:]
        H = np.zeros((len(sums), 10, 10))
        schur = sums[..., :_SEEN, :_SEEN] - B @ np.linalg.solve(others, B.swapaxes(-1, -2))
        H[:, :_SEEN, :_SEEN] = schur.sum(axis=1)
        H = np.linalg.solve(np.eye(10) + H @ self.prior.phantom_covariance, H)
        D = compute_jacobian(self.theta)
        precision = D.T @ H @ D + SolidPrior.for_hand().precision
        return np.sqrt(np.linalg.inv(precision)[:, 0, 0])


def run_pool(config: PosewiseConfig, repeat: int) -> dict[str, NDArray[Any]]:
    """Chooses postures from one pool.

    Returns:
        ``log_mass`` and ``log_sd`` for each number of postures, (numbers,), and the true ``mass``, [kg].
    """
    task, mass = prepare_task(config.data, config.name)
    rng = np.random.default_rng([config.seed, repeat, LBIPE_OBJECTS.index(config.name)])
    pool = rng.choice(len(task.evidence.samples.signal), _POOL, replace=False)
    chosen = _choose(task, config.rule, pool, max(config.numbers))
    modes = [find_posterior(task, chosen[:number]) for number in config.numbers]
    log_mass = np.array([mode.theta[0] for mode in modes])
    log_sd = np.sqrt([mode.covariance[0, 0] for mode in modes])
    return {"log_mass": log_mass, "log_sd": log_sd, "mass": np.array(mass)}


@cache
def prepare_task(data: str, name: str) -> tuple[Task, float]:
    """Collects what the other objects tell about an object; also returns the object's true mass, [kg]."""
    settings = replace(IdentificationSettings(), signal_prior=SERVO_PRIOR)
    objects = load_weighed_objects(Path(data))
    evidence, gains = calibrate_by_others(objects, name, settings)
    others = [each for key, each in objects.items() if key != name]
    mass = float(np.mean([each.mass for each in others]))
    theta = SolidPrior.for_hand().with_mass(mass, mass).mean.copy()
    theta[0] = np.log(mass)
    theta[1:4] = np.mean([each.first_moment for each in others], axis=0) / mass
    evidence = evidence.with_load(parameters_from_theta(theta))
    return Task(evidence, gains, build_channel_prior(evidence, gains, settings), theta), objects[name].mass


def _choose(task: Task, rule: str, pool: NDArray[np.intp], number: int) -> list[int]:
    """Chooses postures from a pool one after the other; each is the best addition to those before it."""
    if rule == "random":
        return [int(each) for each in pool[:number]]
    rows = task.build_rows()[pool]
    products = rows[..., :, None] * rows[..., None, :]
    weights = task.gains.mean[:, 0] / np.sqrt(task.gains.least_variance)
    W = task.evidence.samples.Y[pool][..., :_SEEN] * weights[:, None]
    D = compute_jacobian(task.theta)
    known = np.linalg.inv((D @ SolidPrior.for_hand().covariance @ D.T)[:_SEEN, :_SEEN])
    chosen: list[int] = []
    for _ in range(number):
        if rule.startswith("stated"):
            if chosen and rule == "stated":  # the next posture is chosen for the body identified so far
                task = task.expect(find_posterior(task, [int(each) for each in pool[chosen]]).theta)
                rows = task.build_rows()[pool]
                products = rows[..., :, None] * rows[..., None, :]
            scores = task.predict(products[chosen].sum(axis=0) + products)
        elif rule == "d_optimal":
            H = known + np.einsum("njk,njl->kl", W[chosen], W[chosen]) + W.swapaxes(1, 2) @ W
            scores = -np.linalg.slogdet(H)[1]
        else:
            scores = np.array([score_condition(W[[*chosen, c]].reshape(-1, _SEEN)) for c in range(len(pool))])
        scores[chosen] = np.inf
        chosen.append(int(np.argmin(scores)))
    return [int(each) for each in pool[chosen]]


def score_condition(rows: Array) -> float:
    """Scores a regressor; lower is better.

    The score is the log condition number with columns scaled to unit length, plus the log of the inverse of its
    smallest singular value.
    """
    length = np.maximum(np.linalg.norm(rows, axis=0), 1e-12)
    values = np.linalg.svd(rows / length, compute_uv=False)
    least = np.linalg.svd(rows, compute_uv=False)[-1]
    return float(np.log(values[0] / max(values[-1], 1e-9)) - np.log(max(least, 1e-9)))


def find_posterior(task: Task, chosen: list[int]) -> Mode:
    """Computes the most probable body given the chosen postures."""
    kept = np.isin(np.arange(len(task.evidence.samples.signal)), chosen)
    statistics = compute_statistics(task.evidence.samples.select(kept), 1)
    likelihood = PayloadLikelihood(statistics, task.prior, task.gains.least_variance)
    return find_mode(likelihood, SolidPrior.for_hand())


def describe_posewise(found: Mapping[str, list[dict[str, NDArray[Any]]]], numbers: tuple[int, ...]) -> dict[str, Any]:
    """Summarises the results of each rule, a list over objects; root mean squares are averaged over objects."""
    rules: dict[str, Any] = {}
    for rule, objects in found.items():
        rmse, said, inside = [], [], []
        for each in objects:
            mass, truth = np.exp(each["log_mass"]), each["mass"][:, None]
            rmse.append(np.sqrt(np.mean((mass - truth) ** 2, axis=0)))
            said.append(np.mean(mass * each["log_sd"], axis=0))
            inside.append(np.mean(np.abs(each["log_mass"] - np.log(truth)) <= TO_90 * each["log_sd"], axis=0))
        rules[rule] = {
            "rmse_g": 1e3 * np.mean(rmse, axis=0),
            "said_sd_g": 1e3 * np.mean(said, axis=0),
            "inside_90": np.mean(inside, axis=0),
        }
    reference = rules["random"]["rmse_g"][numbers.index(_REFERENCE)]
    own = rules["stated"]["rmse_g"]
    reached = np.flatnonzero(own <= reference)
    return {
        "poses": list(numbers),
        "rules": rules,
        "poses_as_8_random": int(numbers[reached[0]]) if reached.size else max(numbers) + 1,
        "rmse_of_8_random_g": reference,
        "worse_with_more": float((own / np.minimum.accumulate(own)).max() - 1.0),
        "inside_90": float(rules["stated"]["inside_90"].mean()),
    }
