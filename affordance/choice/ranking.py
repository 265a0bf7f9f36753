"""Rules of choice: which of several objects to take, and how to grip it.

The paper's rule draws one density from the belief and takes the option that is cheapest under it; Bayes' rule takes
the option of least expected work.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.object_belief import Memory
from affordance.choice.inner_simulation import Choice, TaskCostModel, plan_choice
from affordance.choice.motion_cost import Costs
from affordance.choice.options import Option
from affordance.exceptions import AffordanceError
from affordance.settings import DEFAULT_SETTINGS, Settings

type Chosen = NDArray[np.intp]

# Costs within this fraction of each other are equal: what is left is rounding.
TIE = 1e-9
NO_OPTION = -1


class RankedOption(NamedTuple):
    """An option with what it is believed to cost.

    Attributes:
        option: The option.
        work: Expected work over the samples under which all usable options are feasible, [J].
        works: Work under each sample, (S,), [J]; infinite where a torque limit would be broken.
        effort: Expected integral of |tau|^2 dt over the same samples as work, [N^2 m^2 s].
        p_best: Probability that it is the cheapest.
        p_feasible: Probability that it is feasible: that it keeps the torque limits and does what is asked.
        infeasible_reason: Why it is not usable: infeasible at the most probable densities; empty if it is.
    """

    option: Option
    work: float
    works: Array
    effort: float
    p_best: float
    p_feasible: float
    infeasible_reason: str


class Ranking(NamedTuple):
    """The options in the order of their expected work.

    Attributes:
        ranked: Those that are usable, the least expected work first, exact ties in random order; then the others,
            which are never chosen. Should no sample make all usable options feasible, the most probably feasible
            comes first.
        num_usable: How many are usable.
        p_none: Probability that no option is feasible.
        flips: Whether the least expected integral of |tau|^2 would choose otherwise.
    """

    ranked: tuple[RankedOption, ...]
    num_usable: int
    p_none: float
    flips: bool

    @property
    def best(self) -> RankedOption:
        """What Bayes' rule chooses.

        Raises:
            AffordanceError: No option is usable.
        """
        if self.num_usable == 0:
            reasons = "; ".join(f"{entry.option.name} {entry.infeasible_reason}" for entry in self.ranked)
            raise AffordanceError(f"no option can be used: {reasons}")
        return self.ranked[0]


def rank(
    options: Sequence[Option],
    task: TaskCostModel,
    belief: Memory,
    settings: Settings = DEFAULT_SETTINGS,
    *,
    num_samples: int = 10_000,
    seed: int = 0,
) -> Ranking:
    """Ranks objects and grips by what a task is believed to cost with them.

    Args:
        options: What there is to choose from, at least one; different objects as well as different grips.
        task: What is to be done, such as Reach.
        belief: What is believed of materials; those never met get the prior of the settings.
        settings: Those of arm, prior and controller.
        num_samples: How many densities are drawn from the belief.
        seed: Determines what is drawn.

    Returns: The options, least expected work first.

    Raises:
        ValueError: num_samples is not positive.
        AffordanceError: There is no option, two are of one name, or no motion could be planned.
        ModelFileError: The arm cannot be loaded.
    """
    return rank_options(plan_choice(options, task, settings), belief, np.random.default_rng(seed), num_samples)


def rank_options(choice: Choice, memory: Memory, rng: np.random.Generator, num_samples: int) -> Ranking:
    """Ranks options whose motions are planned already; see ``rank``.

    Raises:
        ValueError: num_samples is not positive.
    """
    if num_samples < 1:
        raise ValueError(f"num_samples is {num_samples}, must be at least 1")
    costs = choice.compute_costs(choice.draw_parameters(memory, rng, num_samples))
    chosen = pick_cheapest(costs, rng)
    infeasible_reasons = _find_infeasible_reasons(choice, memory)
    usable = np.array([not infeasible_reason for infeasible_reason in infeasible_reasons])
    shared = costs.feasible[usable].all(axis=0)
    entries = [
        RankedOption(
            option,
            work=_mean(costs.work[i, shared & costs.feasible[i]]),
            works=np.where(costs.feasible[i], costs.work[i], np.inf),
            effort=_mean(costs.effort[i, shared & costs.feasible[i]]),
            p_best=float((chosen == i).mean()),
            p_feasible=float(costs.feasible[i].mean()),
            infeasible_reason=infeasible_reasons[i],
        )
        for i, option in enumerate(choice.options)
    ]
    lots = rng.random(len(entries))
    least = min((entries[i].work for i in np.flatnonzero(usable)), default=0.0)

    def place(i: int) -> tuple[bool, float, float, float]:
        tied = entries[i].work <= least * (1.0 + TIE)
        merit = -entries[i].p_feasible if not shared.any() else 0.0
        return not usable[i], merit, least if tied else entries[i].work, lots[i]

    order = sorted(range(len(entries)), key=place)
    efforts = [entries[i].effort for i in np.flatnonzero(usable)]
    return Ranking(
        tuple(entries[i] for i in order),
        num_usable=int(usable.sum()),
        p_none=float((chosen == NO_OPTION).mean()),
        flips=bool(shared.any() and efforts and entries[order[0]].effort > min(efforts) * (1.0 + TIE)),
    )


def _find_infeasible_reasons(choice: Choice, memory: Memory) -> list[str]:
    """Why each option is infeasible at the most probable densities; empty where it is not."""
    densities = choice.add_colours(memory).belief.add_object_variation(choice.settings.prior.deviation_sd)
    feasible = choice.compute_costs(choice.compute_parameters(memory, densities.compute_mode()[None])).feasible[:, 0]
    return [
        cost_model.infeasible_reason or ("" if fits else "breaks a torque limit as believed")
        for cost_model, fits in zip(choice.cost_models, feasible, strict=True)
    ]


def pick_cheapest(costs: Costs, rng: np.random.Generator) -> Chosen:
    """Picks the feasible option of least work under each sample; among equals a fair coin decides.

    Args:
        costs: Arrays of shape (options, S).
        rng: The coin.

    Returns: Index of the option, or NO_OPTION where none is feasible, shape (S,).
    """
    work = np.where(costs.feasible, costs.work, np.inf)
    least = work.min(axis=0)
    equal = costs.feasible & (work <= least * (1.0 + TIE))
    lots = np.where(equal, rng.random(work.shape), -1.0)
    picked: Chosen = np.where(equal.any(axis=0), lots.argmax(axis=0), NO_OPTION)
    return picked


def _mean(values: Array) -> float:
    """Mean; infinite if there is no value."""
    return float(values.mean()) if len(values) else np.inf
