"""Inner simulation against full simulation: stick, hammer and random crooked tools, both tasks, sampled beliefs.

A belief is one density for each material: every other one is drawn from the prior, the others from an observer's
belief after one trial. Under each of them both grips of a tool are evaluated twice: by inner simulation, as this
project's robots choose, and by moving the arm in Drake, with contact. Works must agree within BOUND wherever both
find the task feasible, and choices in at least LEAST_SAME. One hundred beliefs for 22 tools take some 70 minutes on
two cores.
"""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import NamedTuple, cast

import numpy as np
from scipy.spatial.transform import Rotation

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.hammer import Hammer
from affordance.choice.inner_simulation import Choice, plan_choice
from affordance.choice.listed_options import list_options
from affordance.choice.motion_cost import Costs
from affordance.choice.ranking import NO_OPTION, Chosen, pick_cheapest
from affordance.choice.reach import Reach
from affordance.exceptions import AffordanceError
from affordance.experiments.protocol_runs import load_choice_experiment
from affordance.experiments.shared.experience import ExperienceConfig
from affordance.experiments.shared.gain_experience import gain_experience
from affordance.objects.colour import Colour
from affordance.objects.inertia import Ellipsoid
from affordance.objects.tool import Component, Grip, Tool
from affordance.runs.repeats import run_tasks
from affordance.settings import Settings
from affordance.simulation.blow import FORCE_TOLERANCE, simulate_blow
from affordance.simulation.rollout import roll_out
from studies.robustness.choosing import list_blow_costs

BOUND, LEAST_SAME = 0.02, 0.98
HEADER = [
    "task",
    "tool",
    "same choice",
    "of",
    "else more costly by",
    "largest difference of works",
    "infeasible: inner, full",
]
# Parts of a crooked tool: semi-axes along and across, [m], and largest bend, [rad].
_LONG, _ACROSS, _MAX_BEND = (0.05, 0.10), (0.01, 0.025), np.radians(60.0)


class Comparison(NamedTuple):
    """Costs by inner and by full simulation of one tool, for S beliefs and G grips."""

    inner: Costs  # costs by inner simulation, (G, S) each
    full: Costs  # costs by full simulation, (G, S) each; effort is not simulated

    @property
    def differences(self) -> Array:
        """Relative differences of the works where both find the task feasible, (N,)."""
        both = self.inner.feasible & self.full.feasible
        return np.abs(self.full.work[both] / self.inner.work[both] - 1.0)

    @property
    def num_same(self) -> int:
        """Number of equal choices."""
        one, other = self.choose()
        return int((one == other).sum())

    @property
    def losses(self) -> Array:
        """Relative excess of simulated work of inner simulation's choices over full simulation's, (N,)."""
        one, other = self.choose()
        samples = np.flatnonzero((one != NO_OPTION) & (other != NO_OPTION))
        losses: Array = self.full.work[one[samples], samples] / self.full.work[other[samples], samples] - 1.0
        return losses

    def choose(self) -> tuple[Chosen, Chosen]:
        """Returns the choices by inner and by full simulation, (S,) each."""
        one, other = (pick_cheapest(costs, np.random.default_rng(0)) for costs in (self.inner, self.full))
        return one, other


def draw_crooked(rng: np.random.Generator, name: str, materials: Sequence[Component]) -> Tool:
    """Draws a tool of two parts, bent at their joint, with two grips: by either end, along the part that is held.

    The new parts have the materials and appearances of given ones.
    """
    lengths = rng.uniform(*_LONG, 2)
    shapes = [
        Ellipsoid((float(length), float(rng.uniform(*_ACROSS)), float(rng.uniform(*_ACROSS)))) for length in lengths
    ]
    bend, around = rng.uniform(0.0, _MAX_BEND), rng.uniform(0.0, 2.0 * np.pi)
    R = Rotation.from_rotvec(bend * np.array([0.0, np.cos(around), np.sin(around)])).as_matrix()
    joint = np.array([2.0 * lengths[0], 0.0, 0.0])
    first, second, end = np.eye(4), np.eye(4), np.eye(4)
    first[0, 3] = lengths[0]
    second[:3, :3], second[:3, 3] = R, joint + R @ [lengths[1], 0.0, 0.0]
    end[:3, :3], end[:3, 3] = R @ np.diag([-1.0, -1.0, 1.0]), joint + R @ [2.0 * lengths[1], 0.0, 0.0]
    parts = [
        Component(shape, X_TE, like.material, like.looks_like)
        for shape, X_TE, like in zip(shapes, (first, second), materials, strict=True)
    ]
    return Tool(name, tuple(parts), (Grip("one", np.eye(4)), Grip("other", end)))


def draw_densities(experience: ExperienceConfig, settings: Settings, count: int) -> Array:
    """Draws densities alternately from the prior and from the belief after one trial, (count, 2)."""
    learned = gain_experience(experience, 0)
    beliefs = [DensityBelief(learned["precision"][k], learned["information_vector"][k]) for k in (0, 1)]
    rng = np.random.default_rng(0)
    drawn = [belief.add_object_variation(settings.prior.deviation_sd).draw_samples(rng, count) for belief in beliefs]
    return np.stack(drawn, axis=1).reshape(2 * count, -1)[:count]


def compare(tool: Tool, task: Reach | Hammer, experience: ExperienceConfig, rho: Array) -> Comparison:
    """Evaluates both grips of a tool by inner and full simulation, with densities of materials, (S, 2), [kg/m^3]."""
    choice = plan_choice(list_options(tool), task, experience.settings)
    memory = MaterialMemory().add_colours(experience.colours, experience.settings.prior)
    inner = choice.compute_costs(choice.compute_parameters(memory, rho))
    return Comparison(inner, simulate_all(tool, task, choice, experience.colours, rho))


def simulate_all(tool: Tool, task: Reach | Hammer, choice: Choice, colours: Sequence[Colour], rho: Array) -> Costs:
    """Moves the arm with each grip of a tool, with contact, under densities of its colours, (S, M), [kg/m^3].

    Returns: Costs, (G, S) each; effort is not simulated.
    """
    shape = (len(tool.grips), len(rho))
    work, feasible = np.full(shape, np.inf), np.zeros(shape, dtype=bool)
    for k, densities in enumerate(rho):
        known = dict(zip(colours, map(float, densities), strict=True))
        for grip in range(len(tool.grips)):
            work[grip, k], feasible[grip, k] = _simulate(tool, grip, task, choice, known)
    return Costs(work, np.full_like(work, np.nan), feasible, work)


def _simulate(
    tool: Tool, grip: int, task: Reach | Hammer, choice: Choice, densities: dict[Colour, float]
) -> tuple[float, bool]:
    held, settings = tool.gripped_by(tool.grips[grip]), choice.settings
    try:
        if isinstance(task, Reach):
            rollout = roll_out(held, task, densities, settings)
            return rollout.work, rollout.error <= task.path.tolerance
        costs = list(list_blow_costs(choice).values())[grip]
        blow = simulate_blow(held, task, costs, densities, settings)
    except AffordanceError:
        return np.inf, False
    return blow.work, abs(blow.force / task.force - 1.0) <= FORCE_TOLERANCE


def measure(beliefs: int, crooked: int, jobs: int) -> Iterator[list[str]]:
    """Yields rows of a table that compares stick, hammer and drawn tools in both tasks, by some beliefs for each."""
    reaching, hammering = load_choice_experiment("reach"), load_choice_experiment("hammer")
    rho = draw_densities(reaching.experience, reaching.settings, beliefs)
    rng = np.random.default_rng(0)
    parts = reaching.novel[0].components
    tools = [*reaching.novel[:2], *(draw_crooked(rng, f"crooked {number}", parts) for number in range(crooked))]
    tasks: dict[str, Reach | Hammer] = {"reach": cast(Reach, reaching.task), "hammer": cast(Hammer, hammering.task)}
    pairs = [(name, tool) for name in tasks for tool in tools]
    jobs_to_do = [partial(compare, tool, tasks[name], reaching.experience, rho) for name, tool in pairs]
    done = run_tasks(jobs_to_do, jobs=jobs, description="inner and full simulation")
    found = {(name, tool.name): comparison for (name, tool), comparison in zip(pairs, done, strict=True)}
    for (name, tool_name), comparison in found.items():
        differences = comparison.differences
        inner, full = ~comparison.inner.feasible, ~comparison.full.feasible
        largest = f"{100 * differences.max():.2f} %" if len(differences) else ""
        loss = f"{100 * comparison.losses.max(initial=0.0):.2f} %"
        infeasible = f"{inner.sum()}, {full.sum()}"
        yield [name, tool_name, str(comparison.num_same), str(beliefs), loss, largest, infeasible]
    for name in tasks:
        of_task = [comparison for (task, _), comparison in found.items() if task == name]
        differences = np.concatenate([comparison.differences for comparison in of_task])
        same = sum(comparison.num_same for comparison in of_task)
        share = (differences <= BOUND).mean()
        within = f"{100 * differences.max():.2f} %; {100 * share:.1f} % within {100 * BOUND:g} %"
        loss = f"{100 * max(comparison.losses.max(initial=0.0) for comparison in of_task):.2f} %"
        total = beliefs * len(of_task)
        enough = f"{same} ({100 * same / total:.1f} %, must be {100 * LEAST_SAME:g} %)"
        yield [name, "all", enough, str(total), loss, within, ""]
