"""Ranks objects and grips by the expected cost of a task.

Work and effort are compared by their expectation under the belief (Bayes decision rule). Peak loads are compared by
their 95 % quantile, because rare heavy tools slip or overload a joint. Peak loads are the largest fraction of a
torque limit and the largest wrench at the grip. The rule of the paper draws one density from the belief instead, and
chooses the cheapest option for this density.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from affordance.arguments import Seed, check_kind, check_member, check_number, check_seed, check_whole
from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.demand import Criterion, Demand
from affordance.choice.hammer import Hammer, keep_strikers
from affordance.choice.inner_simulation import Choice, Draws, TaskCostModel, plan_choice
from affordance.choice.motion_cost import Costs
from affordance.choice.options import Option, merge_alike
from affordance.choice.picking import MIN_FEASIBILITY, NO_OPTION, TIE, pick_cheapest
from affordance.choice.pricing import Amounts, GripBounds, explain_excess, price_options
from affordance.choice.reasons import Reasons, find_reasons
from affordance.exceptions import AffordanceError
from affordance.files.constraints import Whole
from affordance.files.html_table import build_table
from affordance.plant.load import load_arm
from affordance.plant.serial_chain import ArmOwner
from affordance.settings import DEFAULT_SETTINGS, Settings

_NUM_SAMPLES = Whole(1, 100_000)
# Relative difference below which two costs count as equal; the costs have numerical errors of about this size.
SAME = 1e-3


class RankedOption(NamedTuple):
    """Option with its costs under the belief.

    Attributes:
        option: Ranked option.
        samples: Costs for S samples, which have the same densities for all options, (S,) each. If a motion exceeds a
            torque limit, its costs ignore this limit.
        amounts: Means and 90 % intervals of costs. Loads are included if a bound was given or the criterion uses
            them.
        cost: Cost by the criterion, which determines the order: the mean or, for peak loads, the 95 % quantile.
        p_best: Probability that the option is the cheapest.
        p_feasible: Probability that the option accomplishes the task within the limits of torque and grip.
        infeasible_reason: Reason if the option is not usable: the task is impossible, or ``p_feasible`` is too low.
            Empty if the option is usable.
        q_start: Joint angles at the start of the task, (num_joints,), [rad]; empty if no motion could be planned.
        p_best_of_tool: Probability that the option is the cheapest grip of its tool; NaN unless computed.
    """

    option: Option
    samples: Costs
    amounts: Amounts
    cost: float
    p_best: float
    p_feasible: float
    infeasible_reason: str
    q_start: Array
    p_best_of_tool: float = np.nan

    def __repr__(self) -> str:
        why = f", {self.infeasible_reason}" if self.infeasible_reason else ""
        return f"RankedOption({self.option.name}: {self.work:.3g} J, best with {self.p_best:.2f}{why})"

    @property
    def work(self) -> float:
        """Expected work, [J]."""
        return self.amounts.work.mean

    @property
    def works(self) -> Array:
        """Work for each sample, (S,), [J]; infinite if the option is infeasible."""
        return np.where(self.samples.feasible, self.samples.work, np.inf)

    @property
    def effort(self) -> float:
        """Expected integral of the squared torques, [N^2 m^2 s]."""
        return self.amounts.effort.mean


class Ranking(NamedTuple):
    """Options in order of cost, with unusable options last.

    Attributes:
        ranked: Usable options in order of cost, with exact ties in random order, followed by unusable options in
            order of cost. Unusable options are never chosen.
        num_usable: Number of usable options.
        min_feasibility: Smallest ``p_feasible`` of a usable option.
        p_none: Probability that no option is feasible.
        flips: True if a comparison by effort, the integral of the squared torques, prefers another option.
        criterion: Criterion by which options are compared.

    Example:
        >>> from affordance import MODELS, MaterialMemory, Robot, list_options, load_tools, rank
        >>> stick, *_ = load_tools(MODELS / "tools" / "novel.yaml")
        >>> known = MaterialMemory.from_densities({"steel": 7850, "beech": 720})
        >>> ranking = rank(list_options(stick), Robot().load_task("reach"), known, num_samples=200)
        >>> ranking.best.option.name, f"{ranking.best.work:.1f} J"
        ('stick by steel', '6.9 J')
    """

    ranked: tuple[RankedOption, ...]
    num_usable: int
    min_feasibility: float
    p_none: float
    flips: bool
    criterion: Criterion = Criterion.WORK

    def __repr__(self) -> str:
        options = "; ".join(f"{each.option.name}, {each.work:.3g} J, {each.p_best:.2f}" for each in self.ranked)
        return f"Ranking({self.num_usable} of {len(self.ranked)} usable: {options})"

    def _repr_html_(self) -> str:
        rows = [
            [
                each.option.name,
                f"{each.work:.3g}",
                f"{each.p_best:.2f}",
                f"{each.p_feasible:.2f}",
                each.infeasible_reason,
            ]
            for each in self.ranked
        ]
        header = ["option", "expected work (J)", "P(best)", "P(feasible)", "not chosen, because it"]
        return build_table("Ranking", header, rows)

    @property
    def best(self) -> RankedOption:
        """Option with the least cost (Bayes decision rule).

        Raises:
            AffordanceError: No option is usable.
        """
        if self.num_usable == 0:
            reasons = "; ".join(f"{entry.option.name} {entry.infeasible_reason}" for entry in self.ranked)
            raise AffordanceError(f"no option can be used: {reasons}")
        return self.ranked[0]

    @property
    def ties(self) -> tuple[RankedOption, ...]:
        """Usable options other than the best whose cost is equal within the fraction ``SAME``."""
        usable = self.ranked[1 : self.num_usable]
        return tuple(each for each in usable if each.cost <= self.best.cost * (1.0 + SAME))


def rank(
    options: Sequence[Option],
    task: TaskCostModel,
    belief: MaterialMemory,
    settings: Settings = DEFAULT_SETTINGS,
    *,
    robot: ArmOwner | None = None,
    num_samples: int = 10_000,
    seed: Seed = 0,
    min_feasibility: float = MIN_FEASIBILITY,
    criterion: Criterion = Criterion.WORK,
    bounds: GripBounds | None = None,
) -> Ranking:
    """Ranks objects and grips by the expected cost of a task.

    Args:
        options: At least one option; options differ in object, grip, or both.
        task: Task, such as Reach.
        belief: Belief about materials. Unknown materials have the prior of the settings.
        settings: Settings of arm, prior and controller, including the measure of work.
        robot: Robot whose arm does the task; None for the arm of the settings.
        num_samples: Number of samples from the belief.
        seed: Seed of the random draws: one or several integers.
        min_feasibility: Smallest probability of feasibility with which an option is usable.
        criterion: Criterion by which options are compared, or its name.
        bounds: Largest wrench that the gripper can hold. None sets no bound; loads on joints and grip are then
            computed only if the criterion uses them.

    Returns:
        Options in order of cost. If the task is a blow and some tools have a striking face, tools without a striking
        face are not ranked. Grips that are equivalent by symmetry form one option, whose ``alike`` lists the others.

    Raises:
        BadArgumentError: An argument has the wrong type or is out of bounds.
        AffordanceError: There is no option, two have the same name, or no motion could be planned.
        ModelFileError: The arm cannot be loaded.
    """
    hint = "list_options(tool) lists those of a tool"
    options = [
        check_kind(f"options[{i}]", each, Option, hint)
        for i, each in enumerate(check_kind("options", options, Sequence, hint))
    ]
    check_kind("task", task, TaskCostModel, "such as Reach(load_path(PATH)) or load_hammer(PATH)")
    check_kind("belief", belief, MaterialMemory, "such as MaterialMemory.from_densities({'brass': 8500})")
    check_kind("settings", settings, Settings)
    if robot is not None:
        robot = check_kind("robot", robot, ArmOwner, "such as Robot.load(FOLDER)")
        settings = replace(settings, arm=robot.directives)
    criterion = check_member("criterion", criterion, Criterion)
    if bounds is not None:
        check_kind("bounds", bounds, GripBounds)
    _check_sampling(num_samples, min_feasibility)
    rng = np.random.default_rng(check_seed(seed))
    options = merge_alike(keep_strikers(options) if isinstance(task, Hammer) else options)
    choice = plan_choice(options, task, settings)
    return rank_options(choice, belief, rng, num_samples, min_feasibility, criterion=criterion, bounds=bounds)


def rank_options(
    choice: Choice,
    memory: MaterialMemory,
    rng: np.random.Generator,
    num_samples: int,
    min_feasibility: float = MIN_FEASIBILITY,
    *,
    criterion: Criterion = Criterion.WORK,
    bounds: GripBounds | None = None,
) -> Ranking:
    """Ranks options whose motions are already planned (``rank``).

    Raises:
        BadArgumentError: The number of samples is out of bounds, or ``min_feasibility`` is not a probability.
    """
    _check_sampling(num_samples, min_feasibility)
    draws = choice.draw(memory, rng, num_samples)
    return rank_draws(choice, draws, rng, min_feasibility, criterion=criterion, bounds=bounds, by_lot=True)


def rank_draws(
    choice: Choice,
    draws: Draws,
    rng: np.random.Generator,
    min_feasibility: float = MIN_FEASIBILITY,
    *,
    criterion: Criterion = Criterion.WORK,
    bounds: GripBounds | None = None,
    by_lot: bool = False,
) -> Ranking:
    """Ranks planned options for given samples of a belief (``rank``).

    If ``by_lot``, options of equal cost are in random order. Otherwise they keep their order, and unusable options
    are sorted by decreasing probability of feasibility.
    """
    costs, demand = price_options(choice, draws.parameters, criterion, bounds)
    chosen = pick_cheapest(costs, rng)
    joint_names = load_arm(choice.settings.arm).joint_names
    entries = []
    for i, (option, plan) in enumerate(zip(choice.options, choice.cost_models, strict=True)):
        samples = Costs(*(each[i] for each in costs))
        amounts = Amounts.of(samples, demand and Demand(*(each[i] for each in demand)), joint_names)
        p_feasible, reason = float(samples.feasible.mean()), plan.infeasible_reason
        if not reason and p_feasible < min_feasibility:
            reason = f"is feasible with a probability of {p_feasible:.4g}, must be at least {min_feasibility:g}"
            reason += f": {explain_excess(plan, draws.parameters[i], bounds or GripBounds(), joint_names)}"
        cost = amounts.cost.p95 if criterion.is_peak else amounts.cost.mean
        p_best = float((chosen == i).mean())
        entries.append(RankedOption(option, samples, amounts, cost, p_best, p_feasible, reason, plan.q_start))
    usable = [i for i, entry in enumerate(entries) if not entry.infeasible_reason]
    least = min((entries[i].cost for i in usable), default=0.0)
    lots = rng.random(len(entries)) if by_lot else np.arange(len(entries))

    def place(i: int) -> tuple[bool, float, float, float]:
        entry, is_usable = entries[i], i in usable
        if not (by_lot or is_usable):
            return True, -entry.p_feasible, entry.cost, lots[i]
        return not is_usable, 0.0, least if entry.cost <= least * (1.0 + TIE) else entry.cost, lots[i]

    order = sorted(range(len(entries)), key=place)
    least_effort = min((entries[i].effort for i in usable), default=np.inf)
    return Ranking(
        tuple(entries[i] for i in order),
        num_usable=len(usable),
        min_feasibility=min_feasibility,
        p_none=float((chosen == NO_OPTION).mean()),
        flips=bool(usable and entries[order[0]].effort > least_effort * (1.0 + TIE)),
        criterion=criterion,
    )


def explain_choice(ranking: Ranking, draws: Draws, options: Sequence[Option]) -> Reasons | None:
    """Explains why the best option is preferred to the second option.

    Args:
        ranking: Ranking computed from these draws and options.
        draws: Samples of the belief.
        options: Options in the order in which they were planned.

    Returns:
        Reasons, in which options are indices of ``ranked``. None if fewer than two options are usable.
    """
    usable = ranking.ranked[: ranking.num_usable]
    if len(usable) < 2:
        return None
    names = list(dict.fromkeys(option.object_name for option in options))
    return find_reasons(
        draws,
        np.array([each.samples.cost for each in usable]),
        np.array([each.samples.feasible for each in usable]),
        np.array([names.index(each.option.object_name) for each in usable]),
        is_peak=ranking.criterion.is_peak,
    )


def _check_sampling(num_samples: int, min_feasibility: float) -> None:
    check_whole("num_samples", num_samples, _NUM_SAMPLES)
    check_number("min_feasibility", min_feasibility, 0.0, 1.0)
