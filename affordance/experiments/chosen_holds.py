"""Observers who choose what they hold next, by what is worth most for tasks to be done with novel objects."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from affordance.belief.object_belief import FeltObject, Memory
from affordance.choice.next_hold import Question, advise_hold
from affordance.choice.options import Option
from affordance.choice.pricing import plan_options
from affordance.choice.tasks import list_tasks, load_task
from affordance.exceptions import BadValueError, describe_choice
from affordance.objects.tool import Tool
from affordance.protocols.block_entries import BlockEntry
from affordance.protocols.object_entries import ProtocolObjects
from affordance.settings import Settings
from affordance.simulation.felt_object import feel_object
from affordance.simulation.trial_record import TrialRecord
from affordance.vision.eye import measure_drawing

# Samples of a belief.
_NUM_SAMPLES = 1000


@dataclass(frozen=True)
class ChosenHolds:
    """Chooser of what an observer holds next, one at a time, and what each object has told.

    Attributes:
        tools: Novel objects, with grips.
        tasks: Tasks that are to be done with them, by the index of the block.
        models: Folder of models, with the tasks' files.
        felt: Objects that were held, by name.
    """

    tools: tuple[Tool, ...]
    tasks: Mapping[int, tuple[str, ...]]
    models: Path
    felt: dict[str, FeltObject] = field(default_factory=dict, metadata={"reports": True})

    def begin(self) -> "ChosenHolds":
        """Returns a chooser for an observer who has held nothing."""
        return replace(self, felt={})

    def choose(
        self, block: int, left: Sequence[Tool], memory: Memory, settings: Settings, seed: tuple[int, ...]
    ) -> tuple[int, bool]:
        """Chooses among the objects that are left; returns the place of one, and true if none is worth holding."""
        options = [
            Option(tool.name, grip.name, measure_drawing(tool), grip.X_TG)
            for tool in self.tools
            for grip in tool.grips
        ]
        questions = [
            Question(name, plan_options(options, load_task(self.models, name), settings))
            for name in self.tasks[block]
        ]
        number = int(np.random.default_rng(seed).integers(2**31))
        advice = advise_hold(left, questions, memory, settings, felt=self.felt, num_samples=_NUM_SAMPLES, seed=number)
        return [tool.name for tool in left].index(advice.next_name), bool(advice.stop)

    def note(self, memory: Memory, record: TrialRecord, settings: Settings) -> None:
        """Notes what was told by a hold that began with a memory; what several holds of an object tell adds up."""
        if record.percept is None:
            return
        percept = record.percept
        _, felt = feel_object(
            percept.features, memory, percept.statistics, percept.num_joints, percept.noise, settings.prior
        )
        earlier = self.felt.get(percept.object_name)
        if earlier is not None and earlier.colours == felt.colours:
            own = felt.own.add(earlier.own)
            felt = felt._replace(own=own, shared=own.marginalise_deviation(settings.prior.deviation_sd))
        self.felt[percept.object_name] = felt


def build_chooser(
    path: Path, blocks: Sequence[BlockEntry], novel: ProtocolObjects, objects: ProtocolObjects, models: Path
) -> ChosenHolds:
    """Builds the chooser of a protocol.

    Raises:
        BadValueError: A task is unknown, a block leaves nothing to choose from, or a novel object has no grip.
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
    return ChosenHolds(novel.tools, tasks, models)
