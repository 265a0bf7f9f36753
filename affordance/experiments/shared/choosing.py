"""Protocols of choices: observers learn from objects, and after each trial choose a grip of a novel tool.

They never hold that tool. The grip that is truly cheaper is found by simulating each with the true densities. How a
task is planned, simulated and shown is handed in; everything that tasks share is here.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from affordance.arrays import Arrays
from affordance.choice.inner_simulation import Choice, OptionCost, TaskCostModel
from affordance.choice.listed_options import list_options
from affordance.choice.off_axis import measure_changes
from affordance.choice.options import Option
from affordance.exceptions import AffordanceError, BadValueError, SeeingError, UnavailableError, name_object
from affordance.experiments.definition import Experiment, Outputs
from affordance.experiments.shared.choice_task import ChoicePlan, ChoiceTask
from affordance.experiments.shared.decisions import (
    check_one_grip_is_cheaper,
    compute_proportions,
    describe_tools,
    draw_proportions,
    label_choices,
    let_observer_choose,
    remove_errors,
)
from affordance.experiments.shared.experience import Experience, ExperienceConfig
from affordance.experiments.shared.gain_experience import collect_experience
from affordance.experiments.shared.presentation_rows import describe_experience, stack_rows, write_rows
from affordance.experiments.shared.recall import recall_all
from affordance.experiments.shared.trajectories import label_motions
from affordance.files.netcdf import Trajectories
from affordance.objects.tool import Tool, list_densities
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.proprioception.faults import NO_FAULTS
from affordance.reporting.section import PlainReport
from affordance.runs.repeats import run_tasks
from affordance.settings import Settings


@dataclass(frozen=True)
class ChoiceExperiment(Experiment):
    """Experiment of a protocol of choices; Simulations III and IV of the paper (IV-C and IV-D) are two of them.

    Objects of the experience are held first, in the block that is named. A grip is chosen for each novel tool, the
    first of which is the paper's. The adapter has the task, and how it is planned, simulated and shown. The files of
    the task and of the novel tools are named in errors.
    """

    name: str
    section: Path
    experience: ExperienceConfig
    novel: tuple[Tool, ...]
    models: Path
    task_file: Path
    novel_file: Path
    block: str
    report: PlainReport = field(metadata={"reports": True})
    adapter: ChoiceTask
    seed: int = field(init=False, metadata={"reports": True})
    settings: Settings = field(init=False, metadata={"reports": True})

    def __post_init__(self) -> None:
        """Takes seed and settings from the experience."""
        object.__setattr__(self, "seed", self.experience.seed)
        object.__setattr__(self, "settings", self.experience.settings)

    @property
    def task(self) -> TaskCostModel:
        """Model of the task's cost."""
        return self.adapter.task

    @property
    def tools_observed(self) -> tuple[Tool, ...]:
        """Novel tools, which the camera sees."""
        return self.novel

    def gain_experience(self, folder: Path, *, repeats: int, jobs: int) -> Experience:
        """Lets observers hold the objects that they learn from."""
        return collect_experience(self.experience, folder, repeats=repeats, jobs=jobs)

    def plan(self, jobs: int) -> ChoicePlan:
        """Plans the choices, and simulates the task with every grip.

        A task that cannot be done with a grip, or without a cheapest one, raises a BadValueError; a picture in which
        a tool is not detected a SeeingError.
        """
        adapter, exact = self.adapter, remove_errors(self.settings)
        choices = self.plan_grips(self.settings, "plans", jobs)
        true = choices
        if adapter.plans_truth and replace(self.settings, faults=exact.faults) != exact:
            true = self.plan_grips(exact, "plans, true", jobs)
        costs = {
            name: {option.grip: cost for option, cost in zip(choice.options, choice.cost_models, strict=True)}
            for name, choice in true.items()
        }
        adapter.check(self.novel, self.task_file, costs)
        simulated = self.simulate(costs, jobs)
        for tool in self.novel:
            for grip, done in simulated[tool.name].items():
                if problem := adapter.describe_error(done, name_object(tool.name), grip, self.settings):
                    raise BadValueError(self.task_file, adapter.key, problem)
            check_one_grip_is_cheaper(self.novel_file, tool, [done.work for done in simulated[tool.name].values()])
        work = partial(adapter.compute_work, exact, costs)
        off_axis = measure_changes(work, self.novel, jobs=jobs, description=f"{adapter.name}: parts moved")
        return ChoicePlan(choices, costs, simulated, off_axis)

    def plan_grips(self, settings: Settings, what: str, jobs: int) -> dict[str, Choice]:
        """Plans the task with each grip of each tool, observed once; an impossible plan raises a BadValueError."""
        settings = replace(settings, faults=NO_FAULTS)  # the inner simulation assumes none
        with self._blame_task():
            options = {
                tool.name: list_options(tool, seed=self.seed, feature_source=settings.feature_source)
                for tool in self.novel
            }
            tasks = [
                partial(_build_cost, self.task, option, settings) for each in options.values() for option in each
            ]
            costs = iter(run_tasks(tasks, jobs=jobs, description=f"{self.adapter.name}: {what}"))
        choices = {name: Choice(each, [next(costs) for _ in each], settings) for name, each in options.items()}
        for choice in choices.values():
            for option, cost in zip(choice.options, choice.cost_models, strict=True):
                if cost.infeasible_reason:
                    problem = f"{self.adapter.failure}: {self.adapter.explain(option.name, cost.infeasible_reason)}"
                    raise BadValueError(self.task_file, self.adapter.key, problem)
        return choices

    def simulate(self, costs: Mapping[str, Mapping[str, Any]], jobs: int) -> dict[str, dict[str, Any]]:
        """Simulates the task under the true densities with every grip of every tool, in processes."""
        exact = remove_errors(self.settings)
        held = {tool.name: tool.list_gripped() for tool in self.novel}
        tasks = [
            partial(self.adapter.simulate, gripped, costs[tool.name][grip], list_densities([tool]), exact)
            for tool in self.novel
            for grip, gripped in held[tool.name].items()
        ]
        with self._blame_task():
            description = f"{self.adapter.name}: {self.adapter.simulations}"
            done = iter(run_tasks(tasks, jobs=jobs, description=description))
        return {name: {grip: next(done) for grip in grips} for name, grips in held.items()}

    @contextmanager
    def _blame_task(self) -> Iterator[None]:
        """Blames the task's file for errors other than those of seeing or of the machine."""
        try:
            yield
        except (SeeingError, UnavailableError):
            raise
        except AffordanceError as error:
            raise BadValueError(self.task_file, self.adapter.key, f"{self.adapter.failure}: {error}") from error

    def select_shared(self, plan: ChoicePlan) -> list[Choice]:
        """Returns the choices, which every observer needs."""
        return list(plan.choices.values())

    def run_observer(self, shared: list[Choice], experience: Experience | None, repeat: int) -> Arrays:
        """Lets an observer choose before the first and after each trial; see ``let_observer_choose``."""
        assert experience is not None  # the experiment has one
        return let_observer_choose(shared, experience, self.seed, repeat)

    def compute_metrics(self, plan: ChoicePlan, experience: Experience | None, arrays: Arrays) -> dict[str, Any]:
        """Computes the numbers of metrics.json."""
        return {
            **compute_proportions(self.novel, plan.choices, plan.simulated, plan.off_axis, arrays, self.experience),
            "density_true": {part.material.name: part.material.density for part in self.novel[0].components},
            **self.adapter.measure(self.novel, self.experience, plan),
        }

    def list_facts(self, plan: ChoicePlan, numbers: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the names of tools and grips, and the facts of the task."""
        return {**describe_tools(self.novel, numbers), **self.adapter.list_facts(self.novel[0])}

    def show(
        self, plan: ChoicePlan, experience: Experience | None, arrays: Arrays, numbers: Mapping[str, Any]
    ) -> Outputs:
        """Returns the figures, trajectories, Diagram and replay of the task, the holds, and the choices."""
        assert experience is not None  # the experiment has one
        first, (figure, title) = self.novel[0], self.adapter.figure
        simulated, correct = plan.simulated[first.name], numbers["correct_grip"]
        trial = self.adapter.get_trial(self.settings, first.list_gripped()[correct], simulated[correct])
        shown = self.adapter.show(self.novel, self.settings.arm, plan, numbers)
        variables, coordinates = shown.trajectories or Trajectories({}, {})
        motions = label_motions([done.record for done in simulated.values()], "simulated, true densities")
        tools = [tool.name for tool in self.novel]
        draw = partial(draw_proportions, self.novel, numbers, title, len(arrays["bayes"]))
        return replace(
            shown,
            figures={**shown.figures, figure: draw},
            trajectories=Trajectories(
                {**label_choices(arrays), **variables, **motions},
                {"trial": list(simulated), "joint": trial.arm.joint_names, **coordinates, "tool": tools},
            ),
            diagram=lambda: trial.diagram,
            writers={"lifts": partial(self.write_lifts, experience, len(arrays["paper"]))},
        )

    def write_lifts(self, experience: Experience, num_observers: int, folder: Path) -> None:
        """Writes lifts.csv, one row per hold of an object."""
        places = range(len(self.experience.tools))
        rows = [
            stack_rows(
                describe_experience(self.experience, experience, recall_all(experience, repeat), places, repeat)
            )
            for repeat in range(num_observers)
        ]
        arrays = {name: np.stack([row[name] for row in rows]) for name in rows[0]}
        learners = {self.settings.learner.value: arrays}
        write_rows(folder / "lifts.csv", learners, self.experience.tools, [self.block])


def _build_cost(task: TaskCostModel, option: Option, settings: Settings) -> OptionCost:
    return task.build_cost(ArmModel(load_arm(settings.arm)), option.gripped, settings)
