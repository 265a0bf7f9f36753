"""Weighing of tools and grips for a task, by a criterion of one's choice, under all that is believed of materials.

Work and effort are compared by their expectation. Peaks, the share of a torque limit and the wrench at the grip, are
compared by their 95 % quantile under the belief, as it is the rare heavy tool that slips or overloads a joint.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.object_belief import Memory
from affordance.choice.demand import Criterion, Demand
from affordance.choice.easing import find_easier
from affordance.choice.inner_simulation import Choice, TaskCostModel
from affordance.choice.motion_cost import Costs
from affordance.choice.options import Option
from affordance.choice.pricing import GripBounds, measure, plan_options
from affordance.choice.ranking import MIN_FEASIBILITY, NO_OPTION, pick_cheapest
from affordance.choice.reasons import Reasons, find_reasons
from affordance.exceptions import AffordanceError
from affordance.plant.load import load_arm
from affordance.settings import Settings

# Levels of the quantiles: both ends of the 90 % interval; the upper one is the 95 % quantile of peaks.
_LEVELS = (0.05, 0.95)


class Amount(NamedTuple):
    """Quantity under the belief: its mean, and the ends of its 90 % interval."""

    mean: float
    p05: float
    p95: float


class Weighed(NamedTuple):
    """Option with what it costs and demands under the belief.

    Attributes:
        option: Weighed option.
        work: Absolute work of the joints, [J].
        effort: Integral of |tau|^2 dt, [N^2 m^2 s].
        margin: Highest share of a joint's torque limit, [1].
        joint: Name of the joint with that share.
        force: Peak force at the grip, [N].
        moment: Peak moment about the grip, [N m].
        cost: Cost by the criterion, in its unit.
        value: Number by which options are ordered: the mean of the cost, or the 95 % quantile of a peak.
        p_best: Probability that the option is the cheapest.
        p_feasible: Probability that the option is feasible: it does the task within the limits of torque and grip.
        infeasible_reason: Reason why the option is not usable; empty if it is usable.
        q_start: Joint angles at the start of the task, (num_joints,), [rad]; none if nothing could be planned.
    """

    option: Option
    work: Amount
    effort: Amount
    margin: Amount
    joint: str
    force: Amount
    moment: Amount
    cost: Amount
    value: float
    p_best: float
    p_feasible: float
    infeasible_reason: str
    q_start: Array


class Advice(NamedTuple):
    """Options in the order of their cost, and the reasons of the choice.

    Attributes:
        ranked: Usable options, the best first; then the others in the same order.
        criterion: Criterion by which they are compared.
        num_usable: Number of usable options.
        p_none: Probability that no option is feasible.
        reasons: Reasons of the choice, whose options are indices of ``ranked``; None if only one option is usable.
        easier: Description of what could be done if no option is usable; empty if one is, or nothing could.
    """

    ranked: tuple[Weighed, ...]
    criterion: Criterion
    num_usable: int
    p_none: float
    reasons: Reasons | None
    easier: str = ""

    @property
    def best(self) -> Weighed:
        """Option to take.

        Raises:
            AffordanceError: No option is usable; the message says why the best of them is not.
        """
        if not self.num_usable:
            nearest, easier = self.ranked[0], f"; {self.easier}" if self.easier else ""
            raise AffordanceError(
                f"no tool can do the task; nearest is {nearest.option.name}: {nearest.infeasible_reason}{easier}"
            )
        return self.ranked[0]


def weigh(
    options: Sequence[Option],
    task: TaskCostModel,
    memory: Memory,
    settings: Settings,
    *,
    criterion: Criterion = Criterion.WORK,
    bounds: GripBounds = GripBounds(),
    num_samples: int = 10_000,
    rng: np.random.Generator,
) -> Advice:
    """Weighs options for a task; motions planned before in this process are not planned again.

    Args:
        options: Options to choose from, at least one, each of another name.
        task: Task to be done.
        memory: Belief about materials.
        settings: Settings of arm, prior and controller.
        criterion: Criterion by which options are compared.
        bounds: Largest wrench that the gripper holds.
        num_samples: Number of samples of the belief.
        rng: Random generator of the samples.

    Raises:
        AffordanceError: There is no option, or two have the same name.
        ModelFileError: The arm cannot be loaded.
    """
    choice = plan_options(options, task, settings)
    draws = choice.draw(memory, rng, num_samples)
    costs, demand = measure(choice, draws.parameters, criterion, bounds)
    chosen = pick_cheapest(costs, rng)
    joint_names = load_arm(settings.arm).joint_names
    weighed = [
        _weigh_one(choice, i, costs, demand, (chosen == i).mean(), (criterion, bounds), joint_names)
        for i in range(len(options))
    ]
    order = sorted(range(len(weighed)), key=lambda i: _place(weighed[i]))
    usable = [i for i in order if not weighed[i].infeasible_reason]
    reasons = None
    if len(usable) > 1:
        rival = max(usable[1:], key=lambda i: weighed[i].p_best)
        names = list(dict.fromkeys(option.object_name for option in options))
        objects = np.array([names.index(options[i].object_name) for i in usable])
        # Usable options come first in ``ranked``, in this order.
        reasons = find_reasons(
            draws,
            costs.cost[usable],
            costs.feasible[usable],
            objects,
            (0, usable.index(rival)),
            is_peak=criterion.is_peak,
        )
    easier = ""
    if not usable:
        easier = find_easier(options[order[0]], task, memory, settings, bounds.admit, rng)
    p_none = float((chosen == NO_OPTION).mean())
    return Advice(tuple(weighed[i] for i in order), criterion, len(usable), p_none, reasons, easier)


def _place(weighed: Weighed) -> tuple[float, float]:
    """Returns what options are ordered by: usable ones by their cost, others by how probably they are feasible."""
    return (-weighed.p_feasible, weighed.value) if weighed.infeasible_reason else (-2.0, weighed.value)


def _weigh_one(
    choice: Choice,
    index: int,
    costs: Costs,
    demand: Demand,
    p_best: float,
    by: tuple[Criterion, GripBounds],
    joint_names: Sequence[str],
) -> Weighed:
    plan, (criterion, bounds) = choice.cost_models[index], by
    loads = demand.loads[index]
    worst = int(np.argmax(np.quantile(loads, _LEVELS[1], axis=1))) if np.isfinite(loads).all() else 0
    margin, force, moment, cost = (
        _summarise(each) for each in (loads.max(axis=0), demand.force[index], demand.moment[index], costs.cost[index])
    )
    p_feasible = float(costs.feasible[index].mean())
    reason = plan.infeasible_reason
    if not reason and p_feasible < MIN_FEASIBILITY:
        risk = f"is feasible with a probability of {p_feasible:.4g}, must be at least {MIN_FEASIBILITY:g}"
        reason = f"{risk}: {_name_limit(margin, joint_names[worst], force, moment, bounds)}"
    return Weighed(
        choice.options[index],
        _summarise(costs.work[index]),
        _summarise(costs.effort[index]),
        margin,
        joint_names[worst],
        force,
        moment,
        cost,
        cost.p95 if criterion.is_peak else cost.mean,
        float(p_best),
        p_feasible,
        reason,
        plan.q_start,
    )


def _summarise(values: Array) -> Amount:
    if not np.isfinite(values).all():
        return Amount(np.inf, np.inf, np.inf)
    low, high = np.quantile(values, _LEVELS)
    return Amount(float(values.mean()), float(low), float(high))


def _name_limit(margin: Amount, joint: str, force: Amount, moment: Amount, bounds: GripBounds) -> str:
    """Names the limit that is exceeded most, by the 95 % quantile of what is demanded."""
    excess = {
        f"{joint} must bear {margin.p95:.3g} times its torque limit": margin.p95,
        f"the grip must hold {force.p95:.3g} N, --max-grip-force allows {bounds.force:g} N": force.p95 / bounds.force,
        f"the grip must hold {moment.p95:.3g} N m, --max-grip-moment allows {bounds.moment:g} N m": (
            moment.p95 / bounds.moment
        ),
    }
    worst = max(excess, key=lambda each: excess[each])
    return worst if excess[worst] > 1.0 else "the motion must be faster than the joints' velocity limits allow"
