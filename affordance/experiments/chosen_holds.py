"""Observers who choose what they hold next, by what is worth most for tasks to be done with novel objects."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from affordance.belief.density_belief import Prior
from affordance.belief.object_belief import FeltObject, Memory
from affordance.choice.demand import Criterion
from affordance.choice.next_hold import Question, advise_hold
from affordance.choice.options import Option
from affordance.choice.pricing import plan_options
from affordance.choice.tasks import is_any_still, list_tasks, load_task
from affordance.exceptions import BadValueError, describe_choice
from affordance.objects.tool import Tool
from affordance.protocols.block_entries import BlockEntry
from affordance.protocols.object_entries import ProtocolObjects
from affordance.settings import Settings
from affordance.vision.eye import measure_drawing

# Samples of a belief.
_NUM_SAMPLES = 1000


@dataclass(frozen=True)
class ChosenHolds:
    """Chooser of what an observer holds next, one at a time, for tasks of blocks, by index, with novel tools."""

    tools: tuple[Tool, ...]
    objects: tuple[Tool, ...]
    tasks: Mapping[int, tuple[str, ...]]
    models: Path

    def choose(
        self, block: int, left: Sequence[Tool], memory: Memory, settings: Settings, seed: tuple[int, ...]
    ) -> tuple[int, bool]:
        """Chooses among the remaining objects; returns the index of one, and true if none is worth holding."""
        options = [
            Option(tool.name, grip.name, measure_drawing(tool), grip.X_TG)
            for tool in self.tools
            for grip in tool.grips
        ]
        tasks = {name: load_task(self.models, name) for name in self.tasks[block]}
        questions = [Question(name, plan_options(options, task, settings)) for name, task in tasks.items()]
        criterion = Criterion.GRIP if is_any_still(tasks.values()) else Criterion.WORK
        number = int(np.random.default_rng(seed).integers(2**31))
        felt = self.list_felt(memory, settings.prior)
        advice = advise_hold(
            left,
            questions,
            memory,
            settings,
            criterion=criterion,
            felt=felt,
            num_samples=_NUM_SAMPLES,
            seed=number,
        )
        return [tool.name for tool in left].index(advice.next_name), bool(advice.stop)

    def list_felt(self, memory: Memory, prior: Prior) -> dict[str, FeltObject]:
        """Lists the evidence of a memory about each object, by name.

        Objects that look alike are one, by the name of the first.
        """
        found: dict[str, FeltObject] = {}
        for tool in self.objects:
            felt = memory.recall([part.appearance for part in measure_drawing(tool)], prior).felt
            if felt is not None and all(felt.appearance != each.appearance for each in found.values()):
                found[tool.name] = felt
        return found


def build_chooser(
    path: Path, blocks: Sequence[BlockEntry], novel: ProtocolObjects, objects: ProtocolObjects, models: Path
) -> ChosenHolds:
    """Builds the chooser of a protocol.

    An unknown task, a block that leaves nothing to choose from, or a novel object without a grip raises a
    BadValueError.
    """
    known = list_tasks(models)
    tasks = {}
    for index, block in enumerate(blocks):
        if not block.is_chosen:
            continue
        tasks[index] = tuple(block.chosen_for or ())
        for place, name in enumerate(tasks[index]):
            if name not in known:
                raise BadValueError(path, f"blocks[{index}].chosen for[{place}]", describe_choice(name, known))
        others = set(objects.groups[block.objects]) - set(objects.groups[block.first] if block.first else ())
        if len(others) < 2:
            problem = f"leaves {len(others)} to choose from, must leave at least 2"
            raise BadValueError(path, f"blocks[{index}].objects", problem)
    for tool in novel.tools:
        if not tool.grips:
            raise BadValueError(novel.path, f"tools: {tool.name}.grips", "is missing, must be at least 1")
    if sum(len(tool.grips) for tool in novel.tools) < 2:
        raise BadValueError(novel.path, "tools", "have 1 grip, must have at least 2 to choose from")
    return ChosenHolds(novel.tools, objects.tools, tasks, models)
