"""Task for which observers choose a grip: how it is planned, simulated and shown, apart from who chooses."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

from affordance.choice.inner_simulation import Choice, TaskCostModel
from affordance.exceptions import name_object
from affordance.experiments.definition import Outputs
from affordance.experiments.shared.experience import ExperienceConfig
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.settings import Settings


class ChoicePlan(NamedTuple):
    """Plan that all observers share."""

    choices: Mapping[str, Choice]  # choice of a grip by tool, with features as they are observed
    # Costs planned for the true tools, by tool and grip, if the task plans them; else for those observed.
    costs: Mapping[str, Mapping[str, Any]]
    simulated: Mapping[str, Mapping[str, Any]]  # simulations of the task under the true densities, by tool and grip
    off_axis: Mapping[str, float]  # largest relative change of the work if a part is shifted by 2 mm, by tool


class ChoiceTask(ABC):
    """Task for which a grip is chosen; derived classes are frozen dataclasses."""

    name: ClassVar[str]
    simulations: ClassVar[str]  # noun for its simulations in progress bars
    key: ClassVar[str]  # key of the task's file that is blamed if the task cannot be done
    failure: ClassVar[str]  # words for a task that cannot be done
    figure: ClassVar[tuple[str, str]]  # name of the figure of proportions, and its title
    names: ClassVar[tuple[str, ...]]  # names of the numbers and facts that the task adds to those of every choice
    names_of_second_tool: ClassVar[tuple[str, ...]] = ()  # names of the numbers that it adds about a second tool
    plans_truth: ClassVar[bool] = False  # True to plan with the true features too, where others are observed
    task: TaskCostModel

    @abstractmethod
    def simulate(self, held: Tool, cost: Any, densities: Mapping[Colour, float], settings: Settings) -> Any:
        """Simulates the task with a gripped tool; returns its work, motion and outcome."""

    @abstractmethod
    def describe_error(self, simulated: Any, tool: str, grip: str, settings: Settings) -> str:
        """Describes the error of a simulation, possibly with remedies; empty if it is within the tolerance."""

    def explain(self, option: str, reason: str) -> str:
        """Explains why the task cannot be done with an option, for a reason that says what the option does."""
        return f"{name_object(option)} {reason}"

    @abstractmethod
    def compute_work(self, settings: Settings, costs: Mapping[str, Mapping[str, Any]], held: Tool) -> float:
        """Plans the task with a gripped tool, and returns its work, [J]; it may be infeasible, an AffordanceError."""

    @abstractmethod
    def measure(self, novel: Sequence[Tool], config: ExperienceConfig, plan: ChoicePlan) -> dict[str, Any]:
        """Computes the numbers of metrics.json that the task adds to those of every choice."""

    @abstractmethod
    def list_facts(self, tool: Tool) -> dict[str, Any]:
        """Returns the facts that the task adds to those of every choice; tool is the first novel one."""

    @abstractmethod
    def show(self, novel: Sequence[Tool], arm: Path, plan: ChoicePlan, numbers: Mapping[str, Any]) -> Outputs:
        """Returns figures, replay, and trajectories other than choices and joint motions, of the first tool."""

    @abstractmethod
    def get_trial(self, settings: Settings, held: Tool, simulated: Any) -> Any:
        """Returns the Diagram in which a gripped tool was simulated."""

    def check(self, tools: Sequence[Tool], path: Path, costs: Mapping[str, Mapping[str, Any]]) -> None:
        """Raises a BadValueError, before anything is simulated, if the task's file asks for what a grip cannot do."""
        return None
