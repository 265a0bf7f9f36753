"""Simulated presentations: objects are held, released from a clamp, moved or looked at."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from affordance.arrays import Array, Arrays
from affordance.belief.object_belief import Memory
from affordance.choice.reach import Reach
from affordance.control.timed_path import TimedPath
from affordance.experiments.chosen_holds import ChosenHolds
from affordance.experiments.definition import OBSERVER_SHOWN, Outputs
from affordance.experiments.shared.experience import Experience, ExperienceConfig
from affordance.experiments.shared.gain_experience import collect_experience
from affordance.experiments.shared.presentation_rows import Presented, expect_mass, see
from affordance.experiments.shared.presented import Means, PresentationExperiment
from affordance.experiments.shared.trajectories import label_results
from affordance.files.netcdf import Trajectories
from affordance.objects.tool import Tool
from affordance.protocols.block_entries import BlockEntry
from affordance.protocols.presentations import Presentation
from affordance.reporting.replay import Scene, write_replay
from affordance.runs.random_streams import Stream
from affordance.settings import Settings
from affordance.simulation.clamp_trial import run_clamp_and_release
from affordance.simulation.rollout import follow_path
from affordance.simulation.trial import Observer, get_runner
from affordance.simulation.trial_record import TrialRecord
from affordance.vision.eye import observe
from affordance.vision.systems import predict_object

_PREDICTED = 9  # in a seed, for objects observed and not held; the draws of a trial count from 0


@dataclass(frozen=True)
class Simulated(Means):
    """Presentations by simulation of the Diagram."""

    expects: bool = False  # True to store the inertial parameters that an observer predicts from sight
    paths: Mapping[int, TimedPath] = field(default_factory=dict)  # paths of reaches, by the index of their block
    chooser: ChosenHolds | None = None  # chooser of what is held next; None if no order is chosen

    is_closed_form = False
    drawn = ("objects", "heights", "heights of points", "density and drop", "lifts")

    def seed_orders(self, seed: int, repeat: int, count: int) -> list[np.random.Generator]:
        """Returns a random generator for each block; that of the first also orders experience."""
        return [
            np.random.default_rng([seed, repeat, Stream.ORDER, *([index] if index else [])]) for index in range(count)
        ]

    def gain_experience(self, config: ExperienceConfig, folder: Path, *, repeats: int, jobs: int) -> Experience:
        """Lets observers hold the objects that they learn from, once for all experiments that share them."""
        return collect_experience(config, folder, repeats=repeats, jobs=jobs)

    def present(
        self, experiment: PresentationExperiment, memory: Memory, drawn: Sequence[Presentation], repeat: int
    ) -> list[Presented]:
        """Presents objects to an observer; holds of a block that teach are those of one ``Observer``."""
        settings = experiment.settings
        # Where all objects share one colour, everything that is seen is taken to have it.
        remembered = experiment.colours if len(experiment.colours) > 1 else ()
        observers: dict[int, Observer] = {}
        presented: list[Presented] = []
        # Errors of measurement are numbered on from those of the experience.
        taught, tested = 0, 0
        if experiment.experience is not None and all(each.block for each in drawn):
            taught = experiment.experience.num_trials
        stopped = set[int]()
        waiting = list(drawn)
        while waiting:
            index, place = waiting[0].block, 0
            block = experiment.blocks[index]
            if self.chooser is not None and block.is_chosen:
                left = [experiment.weigh(each) for each in _list_left(experiment, waiting)]
                chosen_by = (experiment.seed, repeat, Stream.CHOSEN, len(presented))
                place, stops = self.chooser.choose(index, left, memory, settings, chosen_by)
                stopped |= {index} if stops else set()
            presentation = waiting.pop(place)
            tool, before = experiment.weigh(presentation), memory
            seed: tuple[int, ...] = (experiment.seed, repeat, taught)
            if not block.teaches:
                seed = (experiment.seed, repeat, Stream.TEST, tested)
            numbers = self._expect(experiment, tool, memory, seed) if block.measured else {}
            if block.is_chosen:
                numbers["stopped"] = float(index in stopped)
            record: TrialRecord | None = None
            if block.do.hold is not None and block.teaches:
                if presentation.block not in observers:
                    observers[presentation.block] = Observer(
                        get_runner(settings), memory, duration=block.do.duration, remembered=remembered
                    )
                record = observers[presentation.block].hold(tool, seed)
                memory = observers[presentation.block].memory
            elif block.do.look is None:
                record, more = self._run(settings, presentation.block, block, tool, memory, seed)
                numbers |= more
                memory = record.memory if block.teaches else memory
            taught, tested = taught + block.teaches, tested + (not block.teaches)
            seen, p_value = see(tool), np.nan if record is None else record.p_value
            expected = expect_mass(seen, before, settings)
            presented.append(Presented(presentation, seen, (before, memory), expected, p_value, record, numbers))
        return presented

    def describe_beliefs(self, experiment: PresentationExperiment, memories: Sequence[Memory]) -> dict[str, Array]:
        """Returns mode and quantiles of the first density at each moment, and ``densities``, (Q, M), at the first."""
        quantiles = [memory.belief.compute_percentiles(experiment.quantiles) for memory in memories]
        return {
            "density_quantiles": np.stack([each[:, 0] for each in quantiles]),
            "density_mode": np.array([memory.belief.compute_mode()[0] for memory in memories]),
            "densities": quantiles[0],
        }

    def list_facts(self, experiment: PresentationExperiment, numbers: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the conditions of the presentations, and the materials."""
        tools, config = experiment.tools, experiment.experience
        *_, before, last = (tools[0], *tools)
        looks_like = last.components[0].looks_like.name
        return {
            "run_shown": OBSERVER_SHOWN,
            "first": tools[0].name,
            "second": tools[min(1, len(tools) - 1)].name,
            "duration": experiment.duration,
            "num_trials": 0 if config is None else config.num_trials,
            "material": tools[0].components[0].material.name,
            "decoy_looks_like": "the last one" if last.appearance == before.appearance else looks_like,
            "decoy_materials": " and ".join(dict.fromkeys(part.material.name for part in last.components)),
        }

    def show(self, experiment: PresentationExperiment, experience: Experience | None, arrays: Arrays) -> Outputs:
        """Returns figures of single trials, trajectories, Diagram and replay."""
        settings, tools = experiment.settings, experiment.tools
        done = [
            (tools[each.presentation.tool], each.record)
            for each in experiment.present(experience, OBSERVER_SHOWN)
            if experiment.blocks[each.presentation.block].measured
        ]
        held = [(tool, record) for tool, record in done if record is not None]
        if not held:
            return Outputs({})
        duration = experiment.duration
        trial = get_runner(settings).get_diagram(duration)
        scenes = [Scene(tool, record.times, record.q, f"{tool.name}, {tool.mass:.2f} kg") for tool, record in held]
        title = f"{experiment.name}, seed {experiment.seed}"
        return Outputs(
            figures={},
            trajectories=Trajectories(
                label_results(
                    arrays, experiment.quantiles, [record for _, record in done], f"observer {OBSERVER_SHOWN}"
                ),
                {"trial": [tool.name for tool, _ in done], "joint": trial.arm.joint_names},
            ),
            diagram=lambda: trial.diagram,
            replay=lambda path: write_replay(path, settings.arm, scenes, title=title),
        )

    def _run(
        self, settings: Settings, index: int, block: BlockEntry, tool: Tool, memory: Memory, seed: tuple[int, ...]
    ) -> tuple[TrialRecord, dict[str, Any]]:
        """Runs a presentation of the block with an index, and returns its record and further measures."""
        runner, action = get_runner(settings), block.do
        if action.clamp is not None:
            record, clamp = run_clamp_and_release(runner, tool, memory, duration=action.duration, seed=seed)
            return record, {"force": clamp.force}
        if action.reach is not None:
            done = follow_path(tool, Reach(self.paths[index]), memory, settings, seed)
            return done.record, {"work": done.work, "path_error": done.error}
        return runner.run_hold(tool, memory, duration=action.duration, seed=seed), {}

    def _expect(
        self, experiment: PresentationExperiment, tool: Tool, memory: Memory, seed: tuple[int, ...]
    ) -> dict[str, Any]:
        """Returns an object's weight, [N], and, if requested, its predicted and true inertial parameters, (10,)."""
        settings = experiment.settings
        numbers: dict[str, Any] = {"weight": tool.mass * get_runner(settings).gravity}
        if self.expects:
            rng = np.random.default_rng([*seed, _PREDICTED])
            features = observe(tool, settings.feature_source, settings.vision_error, rng)
            belief = predict_object(features, memory, settings.prior)
            numbers["parameters_predicted"] = belief.compute_parameters(belief.densities.compute_mode())
            numbers["parameters_true"] = tool.parameters
        return numbers


def _list_left(experiment: PresentationExperiment, waiting: Sequence[Presentation]) -> list[Presentation]:
    """Lists what an observer may choose: the rest of a repetition, or what comes first in it."""
    now = waiting[0]
    first = experiment.blocks[now.block].first
    if first is not None and now.tool in experiment.objects.groups[first]:
        return [now]
    return [each for each in waiting if (each.block, each.cycle) == (now.block, now.cycle)]
