"""Rules of choice among objects and grips.

The paper's rule draws one density from the belief and takes the cheapest option under it; Bayes' rule takes the
option of least expected work.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arguments import Seed, check_kind, check_number, check_seed, check_whole
from affordance.arrays import Array
from affordance.belief.object_belief import Memory
from affordance.choice.inner_simulation import Choice, TaskCostModel, plan_choice
from affordance.choice.motion_cost import Costs
from affordance.choice.options import Option
from affordance.exceptions import AffordanceError
from affordance.files.constraints import Whole
from affordance.files.html_table import build_table
from affordance.plant.serial_chain import ArmOwner
from affordance.settings import DEFAULT_SETTINGS, Settings

type Chosen = NDArray[np.intp]

# Costs within this fraction of each other count as equal: the difference is rounding.
TIE = 1e-9
NO_OPTION = -1
# An option is usable if it is feasible with at least this probability, unless another is given: the risk of one in
# twenty of the 95 % intervals used throughout.
MIN_FEASIBILITY = 0.95
_NUM_SAMPLES = Whole(1, 1_000_000)


class RankedOption(NamedTuple):
    """Option with its costs under the belief.

    Attributes:
        option: Ranked option.
        work: Expected work over the same densities for all options, [J]. Where a torque limit would be exceeded, the
            work is that of the motion without this limit.
        works: Work under each sample, (S,), [J]; infinite where the option is infeasible.
        effort: Expected integral of the squared torques over the same densities as work, [N^2 m^2 s].
        cost: Expected cost over the same densities by the measure of the settings, which orders the options; the work
            by default.
        p_best: Probability that the option is the cheapest.
        p_feasible: Probability that the option is feasible: that it keeps the torque limits and does the task.
        infeasible_reason: Reason why the option is not usable: it cannot do the task, or its probability of being
            feasible is too low; empty if it is usable.
        p_best_of_tool: Probability that the option is the cheapest grip of its tool, if that was asked for.
    """

    option: Option
    work: float
    works: Array
    effort: float
    cost: float
    p_best: float
    p_feasible: float
    infeasible_reason: str
    p_best_of_tool: float = np.nan

    def __repr__(self) -> str:
        why = f", {self.infeasible_reason}" if self.infeasible_reason else ""
        return f"RankedOption({self.option.name}: {self.work:.3g} J, best with {self.p_best:.2f}{why})"


class Ranking(NamedTuple):
    """Options in the order of their expected cost.

    Attributes:
        ranked: Usable options in the order of expected cost, exact ties in random order; then the others, which are
            never chosen, in the same order.
        num_usable: Number of usable options.
        min_feasibility: Probability with which an option must at least be feasible to be usable.
        p_none: Probability that no option is feasible.
        flips: True if the least expected integral of the squared torques would choose otherwise.
    """

    ranked: tuple[RankedOption, ...]
    num_usable: int
    min_feasibility: float
    p_none: float
    flips: bool

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
        header = ["option", "expected work (J)", "P(best)", "P(feasible)", "not chosen, as it"]
        return build_table("Ranking", header, rows)

    @property
    def best(self) -> RankedOption:
        """Option that Bayes' rule chooses.

        Raises:
            AffordanceError: No option is usable.
        """
        if self.num_usable == 0:
            reasons = "; ".join(f"{entry.option.name} {entry.infeasible_reason}" for entry in self.ranked)
            raise AffordanceError(f"no option can be used: {reasons}")
        return self.ranked[0]

    def list_of(self, tool: str) -> tuple[RankedOption, ...]:
        """Lists the options of a tool, the best first."""
        return tuple(each for each in self.ranked if each.option.object_name == tool)

    def find_best_grip(self, tool: str) -> str:
        """Returns the grip of a tool's best-ranked option."""
        return self.list_of(tool)[0].option.grip


def rank(
    options: Sequence[Option],
    task: TaskCostModel,
    belief: Memory,
    settings: Settings = DEFAULT_SETTINGS,
    *,
    robot: ArmOwner | None = None,
    num_samples: int = 10_000,
    seed: Seed = 0,
    min_feasibility: float = MIN_FEASIBILITY,
) -> Ranking:
    """Ranks objects and grips by the expected cost of a task with them.

    Args:
        options: Options to choose from, at least one: different objects as well as different grips.
        task: Task, such as Reach.
        belief: Belief about materials; those never met get the prior of the settings.
        settings: Settings of arm, prior and controller.
        robot: Robot whose arm does the task; None for the arm of the settings.
        num_samples: Number of densities drawn from the belief.
        seed: Seed of the random draws: a whole number, or several.
        min_feasibility: Probability with which an option must at least be feasible to be usable.

    Returns: Options in the order of their expected cost.

    Raises:
        BadArgumentError: An argument is of the wrong kind or out of bounds.
        AffordanceError: There is no option, two have the same name, or no motion could be planned.
        ModelFileError: The arm cannot be loaded.
    """
    hint = "list_options(tool) lists those of a tool"
    options = [
        check_kind(f"options[{i}]", each, Option, hint)
        for i, each in enumerate(check_kind("options", options, Sequence, hint))
    ]
    check_kind("task", task, TaskCostModel, "such as Reach(load_path(PATH)) or load_hammer(PATH)")
    check_kind("belief", belief, Memory, "such as MaterialMemory.from_densities({'brass': 8500})")
    check_kind("settings", settings, Settings)
    if robot is not None:
        robot = check_kind("robot", robot, ArmOwner, "such as Robot.load(FOLDER)")
        settings = replace(settings, arm=robot.directives)
    _check_sampling(num_samples, min_feasibility)
    seed = check_seed(seed)
    choice = plan_choice(options, task, settings)
    return rank_options(choice, belief, np.random.default_rng(seed), num_samples, min_feasibility)


def rank_options(
    choice: Choice,
    memory: Memory,
    rng: np.random.Generator,
    num_samples: int,
    min_feasibility: float = MIN_FEASIBILITY,
) -> Ranking:
    """Ranks options whose motions are already planned; see ``rank``.

    Raises:
        BadArgumentError: num_samples is out of bounds, or min_feasibility is not a probability.
    """
    _check_sampling(num_samples, min_feasibility)
    costs = choice.compute_costs(choice.draw_parameters(memory, rng, num_samples))
    chosen = pick_cheapest(costs, rng)
    p_feasible = costs.feasible.mean(axis=1)
    entries = [
        RankedOption(
            option,
            work=float(costs.work[i].mean()),
            works=np.where(costs.feasible[i], costs.work[i], np.inf),
            effort=float(costs.effort[i].mean()),
            cost=float(costs.cost[i].mean()),
            p_best=float((chosen == i).mean()),
            p_feasible=float(p_feasible[i]),
            infeasible_reason=choice.cost_models[i].infeasible_reason
            or _describe_risk(float(p_feasible[i]), min_feasibility),
        )
        for i, option in enumerate(choice.options)
    ]
    usable = np.array([not entry.infeasible_reason for entry in entries])
    lots = rng.random(len(entries))
    least = min((entries[i].cost for i in np.flatnonzero(usable)), default=0.0)

    def place(i: int) -> tuple[bool, float, float]:
        tied = entries[i].cost <= least * (1.0 + TIE)
        return not usable[i], least if tied else entries[i].cost, lots[i]

    order = sorted(range(len(entries)), key=place)
    efforts = [entries[i].effort for i in np.flatnonzero(usable)]
    return Ranking(
        tuple(entries[i] for i in order),
        num_usable=int(usable.sum()),
        min_feasibility=min_feasibility,
        p_none=float((chosen == NO_OPTION).mean()),
        flips=bool(efforts and entries[order[0]].effort > min(efforts) * (1.0 + TIE)),
    )


def _check_sampling(num_samples: int, min_feasibility: float) -> None:
    check_whole("num_samples", num_samples, _NUM_SAMPLES)
    check_number("min_feasibility", min_feasibility, 0.0, 1.0)


def _describe_risk(p_feasible: float, least: float) -> str:
    """Describes why an option is too risky; empty if it is not."""
    if p_feasible >= least:
        return ""
    return f"is feasible with a probability of {p_feasible:.3g}, must be at least {least:g}"


def pick_cheapest(costs: Costs, rng: np.random.Generator) -> Chosen:
    """Picks the feasible option of least cost under each sample; ties are broken at random.

    Args:
        costs: Costs, arrays of shape (options, S).
        rng: Random generator that breaks ties.

    Returns: Index of the option, or NO_OPTION where no option is feasible, shape (S,).
    """
    cost = np.where(costs.feasible, costs.cost, np.inf)
    least = cost.min(axis=0)
    equal = costs.feasible & (cost <= least * (1.0 + TIE))
    lots = np.where(equal, rng.random(cost.shape), -1.0)
    picked: Chosen = np.where(equal.any(axis=0), lots.argmax(axis=0), NO_OPTION)
    return picked
