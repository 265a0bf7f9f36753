"""Inner simulation: cost of a task with each option under the belief (paper, IV-C and IV-D).

A motion is planned once per option. It gives the cost of the task for all densities that are drawn from the belief.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.demand import Demand
from affordance.choice.motion_cost import Costs
from affordance.choice.options import Option
from affordance.choice.weighed import Surprise, WeighedObject, condition_on_weighings, draw_drawing_errors
from affordance.exceptions import AffordanceError
from affordance.objects.colour import Colour
from affordance.objects.inertia import Geometry, build_transform_map
from affordance.objects.tool import PosedShape
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.vision.prediction import measure_geometry


class OptionCost(Protocol):
    """Cost of a task with one option, as a function of its inertial parameters."""

    @property
    def q_start(self) -> Array:
        """Joint angles at the start, (num_joints,), [rad]."""

    @property
    def infeasible_reason(self) -> str:
        """Reason if the task is impossible with all inertias of the tool; otherwise empty."""

    def compute(self, pi: Array) -> Costs:
        """Computes the costs for inertial parameters pi, (S, 10)."""

    def compute_demand(self, pi: Array) -> Demand:
        """Computes the peak loads on joints and grip for inertial parameters pi, (S, 10)."""


class Draws(NamedTuple):
    """S samples of the belief about N objects and M colours."""

    colours: tuple[Colour, ...]  # colour of each density, (M,)
    # Density of each object's parts of each colour, (S, N, M), [kg/m^3]. Objects have the order of their first
    # options.
    densities: Array
    used: NDArray[np.bool_]  # True if an object has parts of a colour, (N, M)
    parameters: Array  # inertial parameters of all options, (options, S, 10)
    surprises: tuple[Surprise, ...] = ()  # weighings that contradict the belief


@runtime_checkable
class TaskCostModel(Protocol):
    """Task with a cost for each option."""

    def build_cost(self, model: ArmModel, parts: Sequence[PosedShape], settings: Settings) -> OptionCost:
        """Plans the task with a tool.

        Args:
            model: Model of the arm; its state is changed.
            parts: Parts of the tool, posed relative to the hand.
            settings: Settings of the controller.
        """


def plan_choice(options: Sequence[Option], task: TaskCostModel, settings: Settings = DEFAULT_SETTINGS) -> "Choice":
    """Plans a task with each option.

    Raises:
        AffordanceError: There is no option, two options have the same name, or no motion can be planned with one of
            them.
        ModelFileError: The arm cannot be loaded.
    """
    model = ArmModel(load_arm(settings.arm))
    return Choice(options, [task.build_cost(model, option.gripped, settings) for option in options], settings)


class Choice:
    """Choice between options for one task, with motions that are planned once for all beliefs."""

    def __init__(self, options: Sequence[Option], cost_models: Sequence[OptionCost], settings: Settings) -> None:
        """Stores the options with their cost models.

        Raises:
            AffordanceError: There is no option, or two options have the same name.
        """
        names = [option.name for option in options]
        if not names or len(set(names)) < len(names):
            raise AffordanceError(f"options are {names}, must be at least one, with different names")
        self.options = tuple(options)
        self.cost_models = tuple(cost_models)  # costs of the task with each option
        self.settings = settings
        self._features = {option.object_name: option.features for option in options}
        self._weighings = {option.object_name: option.weighings for option in options}
        self._grip_maps = [build_transform_map(np.linalg.inv(option.X_TG)) for option in options]

    def draw_parameters(self, memory: MaterialMemory, rng: np.random.Generator, num_samples: int) -> Array:
        """Draws inertial parameters of all options, (options, num_samples, 10).

        Within a sample, all options share the mean densities of materials. All grips of an object share its
        deviations from these means and the errors of its features.
        """
        return self.draw(memory, rng, num_samples).parameters

    def draw(self, memory: MaterialMemory, rng: np.random.Generator, num_samples: int) -> Draws:
        """Draws densities and inertial parameters of all options (``draw_parameters``)."""
        memory, columns = self._find_columns(memory)
        geometries = self._measure(columns, memory.belief.size)
        objects = {
            name: WeighedObject(self._features[name], columns[name], self._measure_parts(name), self._weighings[name])
            for name in self._features
        }
        joint, surprises = condition_on_weighings(memory.belief, objects, self.settings.prior)
        rho = joint.draw_samples(rng, num_samples).reshape(num_samples, len(self._features), -1)
        drawn = {}
        for i, (object_name, geometry) in enumerate(geometries.items()):
            if self._weighings[object_name]:
                errors = draw_drawing_errors(objects[object_name], rho[:, i, columns[object_name]], rng)
            else:
                errors = rng.standard_normal((num_samples, len(geometry.Phi_errors)))
            drawn[object_name] = geometry.compute_parameters(rho[:, i], errors)
        used = np.array([geometry.Phi.any(axis=0) for geometry in geometries.values()])
        return Draws(memory.colours, rho, used, self.grip(drawn), surprises)

    def add_colours(self, memory: MaterialMemory) -> MaterialMemory:
        """Adds the colours of all objects to the memory, and thereby determines the order of their densities."""
        return self._recognise(memory)[0]

    def compute_parameters(self, memory: MaterialMemory, rho: Array) -> Array:
        """Computes the inertial parameters of all options, (options, S, 10), from densities.

        Args:
            memory: Memory of the observer.
            rho: Densities in the order of ``add_colours``, (S, M), [kg/m^3]. The last densities may be omitted; they
                are replaced by their expectations given the other densities.
        """
        met, geometries = self._recognise(memory)
        given = rho.shape[1]
        if given < met.belief.size:
            centre, covariance = met.belief.untruncated_mean, met.belief.covariance
            gain = np.linalg.solve(covariance[:given, :given], covariance[:given, given:])
            rho = np.hstack([rho, centre[given:] + (rho - centre[:given]) @ gain])
        return self.grip({object_name: rho @ geometry.Phi.T for object_name, geometry in geometries.items()})

    def compute_costs(self, pi: Array) -> Costs:
        """Computes the costs of all options, (options, S) each, from parameters pi, (options, S, 10)."""
        costs = [cost_model.compute(parameters) for cost_model, parameters in zip(self.cost_models, pi, strict=True)]
        return Costs(*(np.array(column) for column in zip(*costs, strict=True)))

    def compute_demands(self, pi: Array) -> Demand:
        """Computes the peak loads of all options from parameters pi, (options, S, 10).

        Joint loads are (options, num_joints, S), forces and moments (options, S).
        """
        demands = [cost_model.compute_demand(each) for cost_model, each in zip(self.cost_models, pi, strict=True)]
        return Demand(*(np.array(column) for column in zip(*demands, strict=True)))

    def _recognise(self, memory: MaterialMemory) -> tuple[MaterialMemory, dict[str, Geometry]]:
        """Recognises the parts of all objects.

        Returns:
            Memory with their colours, and geometry of each object, with a column for each colour of this memory.
        """
        memory, columns = self._find_columns(memory)
        return memory, self._measure(columns, memory.belief.size)

    def _find_columns(self, memory: MaterialMemory) -> tuple[MaterialMemory, dict[str, list[int]]]:
        """Returns the memory with the colours of all parts, and the index of each part's colour in it."""
        indices: dict[str, list[int]] = {}
        for object_name, features in self._features.items():
            indices[object_name] = []
            for part in features:
                memory, index = memory.recognise(part.colour, part.colour_sd, self.settings.prior, part.lightness_sd)
                indices[object_name].append(index)
        return memory, indices

    def _measure_parts(self, name: str) -> Geometry:
        """Computes the geometry of an object, with a column for each part."""
        return measure_geometry(self._features[name], range(len(self._features[name])), len(self._features[name]))

    def _measure(self, columns: Mapping[str, list[int]], size: int) -> dict[str, Geometry]:
        """Computes the geometry of each object, with a column for each colour."""
        return {
            object_name: measure_geometry(features, columns[object_name], size)
            for object_name, features in self._features.items()
        }

    def grip(self, parameters: Mapping[str, Array]) -> Array:
        """Converts parameters from the frames of objects to the grip frames of all options, (options, S, 10)."""
        grips = zip(self.options, self._grip_maps, strict=True)
        return np.array([parameters[option.object_name] @ grip_map.T for option, grip_map in grips])
