"""Which of several objects to take, and where to hold it: inner simulation (paper, IV-C and IV-D).

An option is an object in a grip, as the eye sees it. For every density that is believed possible, inner simulation
says what the task would cost with each option; from there two rules lead to a choice. The paper's draws one density
and takes what is cheapest under it; Bayes' takes what is expected to cost least.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.memory import Memory
from affordance.belief.object_belief import Geometry
from affordance.choice.motion_cost import Costs
from affordance.choice.options import Option
from affordance.exceptions import AffordanceError
from affordance.objects.inertia import build_transform_map
from affordance.objects.tool import PosedShape
from affordance.plant.arm import load_arm
from affordance.plant.arm_model import ArmModel
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.vision.visual_prior import measure_geometry

Chosen = NDArray[np.intp]

# Costs within this fraction of each other are equal: what is left is rounding.
TIE = 1e-9
NO_OPTION = -1


class OptionCost(Protocol):
    """What a task costs with one option."""

    infeasible_reason: str  # why the option cannot do it, whatever it weighs; empty if it can

    def compute(self, pi: Array) -> Costs:
        """Costs for inertial parameters of shape (S, 10)."""


class TaskCostModel(Protocol):
    """A task that can be asked of any option."""

    def build_cost(self, model: ArmModel, parts: Sequence[PosedShape], settings: Settings) -> OptionCost:
        """Plans the task with a tool made of parts, posed relative to the hand."""


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


class Choice:
    """A choice among options for one task, with the motions planned once for all beliefs."""

    def __init__(self, options: Sequence[Option], task: TaskCostModel, settings: Settings = DEFAULT_SETTINGS) -> None:
        """Plans the task with every option.

        Args:
            options: At least one.
            task: What is to be done.
            settings: Those of arm, prior and controller.

        Raises:
            AffordanceError: There is no option, two are of one name, or no motion could be planned.
            ModelFileError: The arm cannot be loaded.
        """
        names = [option.name for option in options]
        if not names or len(set(names)) < len(names):
            raise AffordanceError(f"options are {names}, must be at least one and each of another name")
        self.options = tuple(options)
        self.settings = settings
        model = ArmModel(load_arm(settings.arm))
        self.cost_models = [task.build_cost(model, option.gripped, settings) for option in options]
        self._features = {option.object_name: option.features for option in options}
        self._grip_maps = [build_transform_map(np.linalg.inv(option.X_TG)) for option in options]

    def draw_parameters(self, memory: Memory, rng: np.random.Generator, num_samples: int) -> Array:
        """Draws inertial parameters of all options from what is believed.

        The options of a sample are made of the same materials: a material's mean density is one for all of them, and
        an object's own deviation from it, and the error of seeing it, are one for all grips of the object.

        Returns: Shape (options, num_samples, 10).
        """
        memory, geometries = self._recognise(memory)
        joint = memory.belief.add_object_variation(self.settings.prior.deviation_sd, len(self._features))
        rho = joint.draw_samples(rng, num_samples).reshape(num_samples, len(self._features), -1)
        drawn = {}
        for i, (object_name, geometry) in enumerate(geometries.items()):
            errors = rng.standard_normal((num_samples, len(geometry.Phi_errors)))
            drawn[object_name] = geometry.compute_parameters(rho[:, i], errors)
        return self._grip(drawn)

    def add_colours(self, memory: Memory) -> Memory:
        """The memory with the looks of all things, which gives all their densities one order."""
        return self._recognise(memory)[0]

    def compute_parameters(self, memory: Memory, rho: Array) -> Array:
        """Inertial parameters of all options at given densities, shape (options, S, 10).

        Args:
            memory: What things are recognised by.
            rho: Densities in the order of ``meet(memory)``, shape (S, M), [kg/m^3]. Those of looks that are only met
                here may be left out: they are what is expected, given the others.
        """
        met, geometries = self._recognise(memory)
        given = rho.shape[1]
        if given < met.belief.size:
            centre, covariance = met.belief.untruncated_mean, met.belief.covariance
            gain = np.linalg.solve(covariance[:given, :given], covariance[:given, given:])
            rho = np.hstack([rho, centre[given:] + (rho - centre[:given]) @ gain])
        return self._grip({object_name: rho @ geometry.Phi.T for object_name, geometry in geometries.items()})

    def compute_costs(self, pi: Array) -> Costs:
        """Costs of all options, each array of shape (options, S), for parameters of shape (options, S, 10)."""
        costs = [cost_model.compute(parameters) for cost_model, parameters in zip(self.cost_models, pi, strict=True)]
        return Costs(*(np.array(column) for column in zip(*costs, strict=True)))

    def rank(self, memory: Memory, rng: np.random.Generator, num_samples: int = 10_000) -> Ranking:
        """Ranks the options by what they are believed to cost; see ``rank``."""
        if num_samples < 1:
            raise ValueError(f"num_samples is {num_samples}, must be at least 1")
        costs = self.compute_costs(self.draw_parameters(memory, rng, num_samples))
        chosen = pick_cheapest(costs, rng)
        infeasible_reasons = self._find_infeasible_reasons(memory)
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
            for i, option in enumerate(self.options)
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

    def _find_infeasible_reasons(self, memory: Memory) -> list[str]:
        """Why each option is infeasible at the most probable densities; empty where it is not."""
        densities = self.add_colours(memory).belief.add_object_variation(self.settings.prior.deviation_sd)
        feasible = self.compute_costs(self.compute_parameters(memory, densities.compute_mode()[None])).feasible[:, 0]
        return [
            cost_model.infeasible_reason or ("" if fits else "breaks a torque limit as believed")
            for cost_model, fits in zip(self.cost_models, feasible, strict=True)
        ]

    def _recognise(self, memory: Memory) -> tuple[Memory, dict[str, Geometry]]:
        """Recognises every part of every thing once; the geometries refer to the looks of the memory returned."""
        indices: dict[str, list[int]] = {}
        for object_name, features in self._features.items():
            indices[object_name] = []
            for part in features:
                memory, index = memory.recognise(part.colour, part.colour_sd, self.settings.prior)
                indices[object_name].append(index)
        size = memory.belief.size
        return memory, {
            object_name: measure_geometry(features, indices[object_name], size)
            for object_name, features in self._features.items()
        }

    def _grip(self, parameters: Mapping[str, Array]) -> Array:
        """Inertial parameters of all options, (options, S, 10), from those of the things in their own frames."""
        grips = zip(self.options, self._grip_maps, strict=True)
        return np.array([parameters[option.object_name] @ grip_map.T for option, grip_map in grips])


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
    return Choice(options, task, settings).rank(belief, np.random.default_rng(seed), num_samples)


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
