"""Protocols of choices: observers learn from objects, and after each trial choose a grip of a novel tool.

A task adds how choices are planned and what each grip truly costs; everything that tasks share is here.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Protocol

import numpy as np

from affordance.choice.inner_simulation import Choice
from affordance.experiments.agreement import save_choices
from affordance.experiments.definition import Arrays
from affordance.experiments.shared.correct_grip import Simulated, find_cheaper_grip
from affordance.experiments.shared.decisions import let_observer_choose
from affordance.experiments.shared.experience import Experience, ExperienceConfig
from affordance.experiments.shared.gain_experience import collect_experience
from affordance.experiments.shared.presentation_rows import describe_experience, stack_rows, write_rows
from affordance.experiments.shared.proportions import compute_proportions
from affordance.objects.tool import Tool
from affordance.reporting.plain_report import PlainReport
from affordance.settings import Settings


class PlannedChoices(Protocol):
    """Part of a plan that all tasks have in common."""

    @property
    def choices(self) -> Mapping[str, Choice]:
        """Choice of a grip, by tool."""

    @property
    def simulated(self) -> Mapping[str, Mapping[str, Simulated]]:
        """Simulations of the task under the true densities, by tool and grip."""

    @property
    def off_axis(self) -> Mapping[str, float]:
        """Largest relative change of the work if a part is shifted by 2 mm, by tool."""


@dataclass(frozen=True)
class ChoiceExperiment:
    """A protocol of choices.

    Attributes:
        name: Name of the protocol.
        section: Path of the protocol's file.
        experience: Objects that are held first, and how they are learned.
        novel: Tools for which a grip is chosen; the first is the paper's.
        models: Folder of models.
        task_file: File of the task, for errors.
        novel_file: File of the novel tools, for errors.
        block: Name of the block in which objects are held first.
        report: Report that the protocol describes.
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

    unit = "observer"
    files_read = ()
    # Names of the numbers and facts that the task adds to those of every choice, and of its numbers of a second tool.
    names_of_task: ClassVar[tuple[str, ...]] = ()
    names_of_second_tool: ClassVar[tuple[str, ...]] = ()

    @property
    def tools_observed(self) -> tuple[Tool, ...]:
        """Novel tools, which the camera sees."""
        return self.novel

    @property
    def seed(self) -> int:
        """Root of every random draw."""
        return self.experience.seed

    @property
    def settings(self) -> Settings:
        """Settings of all simulations."""
        return self.experience.settings

    def with_settings[E: "ChoiceExperiment"](self: E, settings: Settings) -> E:
        """Returns the experiment with other settings."""
        return replace(self, experience=replace(self.experience, settings=settings))

    def split[E: "ChoiceExperiment"](self: E) -> list[tuple[str, E]]:
        """Returns the experiment itself, under an empty prefix."""
        return [("", self)]

    def count_repeats(self, observers: int) -> int:
        """Returns one repeat per observer."""
        return observers

    def gain_experience(self, folder: Path, *, repeats: int, jobs: int) -> Experience:
        """Lets observers hold the objects that they learn from."""
        return collect_experience(self.experience, folder, repeats=repeats, jobs=jobs)

    def get_planned(self, plan: Any) -> PlannedChoices:
        """Returns the part of a plan that all tasks have in common."""
        planned: PlannedChoices = plan
        return planned

    def select_shared(self, plan: Any) -> list[Choice]:
        """Returns the choices, which every observer needs."""
        return list(self.get_planned(plan).choices.values())

    def run_observer(self, shared: list[Choice], experience: Experience | None, repeat: int) -> Arrays:
        """Lets an observer choose before the first and after each trial; see ``let_observer_choose``."""
        assert experience is not None  # the experiment has one
        return let_observer_choose(shared, experience, self.seed, repeat)

    def compute_choice_metrics(self, plan: Any, arrays: Arrays) -> dict[str, Any]:
        """Computes the numbers of metrics.json that all tasks have."""
        planned = self.get_planned(plan)
        return {
            **compute_proportions(
                self.novel,
                planned.choices,
                arrays,
                self.experience,
                correct={name: find_cheaper_grip(done) for name, done in planned.simulated.items()},
                simulated=planned.simulated,
                off_axis=planned.off_axis,
            ),
            "density_true": {part.material.name: part.material.density for part in self.novel[0].components},
        }

    def write_lifts(self, experience: Experience, num_observers: int, folder: Path) -> None:
        """Writes lifts.csv, one row per hold of an object."""
        places = range(len(self.experience.tools))
        rows = [
            stack_rows(describe_experience(self.experience, experience, places, repeat))
            for repeat in range(num_observers)
        ]
        arrays = {name: np.stack([row[name] for row in rows]) for name in rows[0]}
        learners = {self.settings.learner.value: arrays}
        write_rows(folder / "lifts.csv", learners, self.experience.tools, [self.block])

    def list_writers(
        self, plan: Any, experience: Experience | None, arrays: Arrays, numbers: Mapping[str, Any]
    ) -> dict[str, Callable[[Path], None]]:
        """Returns the functions that write the holds, and the choices for comparison with those of other tasks."""
        assert experience is not None  # the experiment has one
        return {
            "lifts": partial(self.write_lifts, experience, len(arrays["paper"])),
            "choices": partial(
                save_choices,
                novel=self.novel,
                choices=self.get_planned(plan).choices,
                chosen=arrays["paper"],
                numbers=numbers,
                settings=self.settings,
                seed=self.seed,
            ),
        }
