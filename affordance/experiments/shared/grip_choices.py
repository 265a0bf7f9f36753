"""Plans for the choice of a grip of each novel tool."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from affordance.choice.inner_simulation import Choice, OptionCost, TaskCostModel
from affordance.choice.observed_options import list_options
from affordance.choice.options import Option
from affordance.objects.tool import Tool
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.proprioception.faults import NO_FAULTS
from affordance.runs.repeats import run_tasks
from affordance.settings import Settings


def plan_choices(
    tools: Sequence[Tool], task: TaskCostModel, settings: Settings, seed: int, *, jobs: int, description: str
) -> dict[str, Choice]:
    """Plans a task with each grip of each tool, in processes; all observers share one observation of a tool.

    Args:
        tools: Novel tools.
        task: Cost model of the task.
        settings: Settings of vision, arm and controller.
        seed: Root of the errors of observation.
        jobs: Number of processes.
        description: Label of the progress bar.

    Returns: Choices, by the name of the tool.

    Raises:
        AffordanceError: The task cannot be planned.
    """
    settings = replace(settings, faults=NO_FAULTS)  # the inner simulation assumes none
    options = {tool.name: list_options(tool, seed=seed, feature_source=settings.feature_source) for tool in tools}
    every = [option for each in options.values() for option in each]
    costs = iter(
        run_tasks(
            [partial(build_cost, task, option, settings) for option in every], jobs=jobs, description=description
        )
    )
    return {name: Choice(each, [next(costs) for _ in each], settings) for name, each in options.items()}


def build_cost(task: TaskCostModel, option: Option, settings: Settings) -> OptionCost:
    """Plans a task with one option."""
    return task.build_cost(ArmModel(load_arm(settings.arm)), option.gripped, settings)
