"""Protocols whose presentations are simulated: objects are held, released from a clamp, moved or looked at.

Simulations I and II of the paper (IV-A and IV-B) are two of them, models/protocols/weight.yaml and com.yaml.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from affordance.belief.learner import Learner
from affordance.belief.learners import start_memory
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import Memory
from affordance.choice.reach import Reach
from affordance.control.timed_path import load_path
from affordance.experiments.definition import OBSERVER_SHOWN, Arrays, Outputs
from affordance.experiments.shared.experience import Experience, ExperienceConfig, build_experience
from affordance.experiments.shared.gain_experience import collect_experience
from affordance.experiments.shared.hold_measures import get_measure, select_learner
from affordance.experiments.shared.hold_outputs import draw_figures, label_results
from affordance.experiments.shared.reaching import present_reach
from affordance.experiments.shared.trajectories import stack_presentations
from affordance.experiments.within_trial import WHITE, WithinTrialStudy, draw_within_trial
from affordance.files.netcdf import Trajectories
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.protocols.block_entries import BlockEntry, change_holds
from affordance.protocols.measured import MeasuredObservers, compute_numbers
from affordance.protocols.number_entries import FigureEntry, NumberEntry
from affordance.protocols.object_entries import ProtocolObjects, find_file
from affordance.protocols.presentations import Presentation, draw_presentations, weigh
from affordance.random_streams import Stream
from affordance.reporting.replay import Scene, write_replay
from affordance.settings import Settings
from affordance.simulation.clamp_trial import run_clamp_and_release
from affordance.simulation.trial import Observer, get_runner
from affordance.simulation.trial_record import TrialRecord
from affordance.vision.observe import observe
from affordance.vision.visual_prior import predict_object

# Quantiles of the belief that are always kept.
QUARTILES = (0.25, 0.5, 0.75)
_PREDICTED = 9  # in a seed: an object is observed and not held; the draws of a trial count from 0


class Done(NamedTuple):
    """What an observer did in a measured presentation.

    Attributes:
        presentation: Which.
        record: The motion; None if the object was only looked at.
        numbers: What was measured besides.
    """

    presentation: Presentation
    record: TrialRecord | None
    numbers: Mapping[str, Any]


@dataclass(frozen=True)
class HoldExperiment:
    """A protocol of simulated presentations.

    Attributes:
        name: Of the protocol.
        section: The protocol's file.
        objects: Those that are presented.
        blocks: Presentations, in order.
        numbers: What is reported.
        figures: What is drawn.
        quantiles: Those of beliefs that are kept.
        expects: Whether what is expected of an object that is seen is kept.
        learners: What observers learn by; figures are of the first.
        told: Materials whose densities observers know, by colour, [kg/m^3].
        models: The folder of models.
        seed: Root of every random draw.
        settings: What all simulations share.
    """

    name: str
    section: Path
    objects: ProtocolObjects
    blocks: tuple[BlockEntry, ...]
    learners: tuple[Learner, ...]
    told: tuple[tuple[Colour, float], ...]
    models: Path
    seed: int
    settings: Settings
    quantiles: tuple[float, ...]
    expects: bool
    numbers: Mapping[str, NumberEntry] = field(metadata={"reports": True})
    figures: Mapping[str, FigureEntry] = field(metadata={"reports": True})

    unit = "observer"

    @property
    def tools(self) -> tuple[Tool, ...]:
        """All objects."""
        return self.objects.tools

    tools_observed = tools

    @property
    def files_read(self) -> tuple[Path, ...]:
        """Paths that objects are moved along."""
        reaches = (block.do.reach for block in self.blocks)
        return tuple(find_file(each.path, self.section, self.models) for each in reaches if each is not None)

    @property
    def colours(self) -> tuple[Colour, ...]:
        """Their colours, in the order of their components."""
        return tuple(dict.fromkeys(part.looks_like.colour for tool in self.tools for part in tool.components))

    @property
    def duration(self) -> float:
        """How long an object is held in the last block in which one is, [s]."""
        return next((block.do.duration for block in self.blocks[::-1] if block.do.duration), 0.0)

    @property
    def experience(self) -> ExperienceConfig | None:
        """What is learned in a first block that is not measured, which protocols share; None if there is none."""
        return build_experience(self.blocks[0], self.objects, self.learners, self.told, self.seed, self.settings)

    def with_settings(self, settings: Settings) -> "HoldExperiment":
        """Returns the experiment with other settings."""
        return replace(self, settings=settings)

    def with_tools(self, tools: Sequence[Tool], groups: Mapping[str, Sequence[int]]) -> "HoldExperiment":
        """Returns the experiment with other objects."""
        return replace(self, objects=ProtocolObjects(tuple(tools), groups, self.objects.path))

    def with_duration(self, duration: float, repetitions: int | None = None) -> "HoldExperiment":
        """Returns the experiment with holds of another duration, [s], and other repetitions of the first block."""
        return replace(self, blocks=change_holds(self.blocks, duration, repetitions))

    def count_repeats(self, observers: int) -> int:
        """One repeat an observer."""
        return observers

    def plan(self, jobs: int) -> None:
        """Nothing is shared."""

    def gain_experience(self, folder: Path, *, repeats: int, jobs: int) -> Experience | None:
        """Lets observers learn in a first block that is not measured; None if there is none."""
        config = self.experience
        return None if config is None else collect_experience(config, folder, repeats=repeats, jobs=jobs)

    def select_shared(self, plan: None) -> None:
        """Nothing is shared."""

    def run_test_pass(self, memory: Memory, repeat: int) -> list[TrialRecord]:
        """Presents the objects of the blocks after the first with what is believed; returns the motions."""
        done, _ = self._run_blocks(memory, list(enumerate(self.blocks))[1:], repeat)
        return [each.record for each in done if each.record is not None]

    def run_presentations(
        self, experience: Experience | None, repeat: int, learner: Learner
    ) -> tuple[list[Done], list[Memory]]:
        """Runs one observer; returns what was done in measured presentations, and memories before and after each."""
        memory, blocks = self._begin(experience, repeat, learner)
        return self._run_blocks(memory, blocks, repeat)

    def _run_blocks(
        self, memory: Memory, blocks: Sequence[tuple[int, BlockEntry]], repeat: int
    ) -> tuple[list[Done], list[Memory]]:
        """Runs some of the blocks; see ``run_presentations``."""
        done: list[Done] = []
        memories: list[Memory] = [memory]
        taught, tested = 0, 0
        for index, block in blocks:
            rng = np.random.default_rng([self.seed, repeat, Stream.ORDER, *([index] if index else [])])
            observer: Observer | None = None
            for presentation in draw_presentations(block, index, self.objects, rng, repeat):
                tool = self._weigh(presentation)
                seed = (self.seed, repeat, taught) if block.teaches else (self.seed, repeat, Stream.TEST, tested)
                numbers = self._expect(tool, memory, seed) if block.measured else {}
                record: TrialRecord | None = None
                if block.do.hold is not None and block.teaches:
                    observer = observer or self._give_observer(memory, block.do.duration)
                    record = observer.hold(tool, seed)
                elif block.do.look is None:
                    record, more = self._present(block, tool, memory, seed)
                    numbers |= more
                if block.teaches and record is not None:
                    memory = observer.memory if observer is not None else record.memory
                taught, tested = taught + block.teaches, tested + (not block.teaches)
                if block.measured:
                    done.append(Done(presentation, record, numbers))
                    memories.append(memory)
        return done, memories

    def run_observer(self, shared: None, experience: Experience | None, repeat: int) -> Arrays:
        """Runs one observer with each learner.

        Returns: Arrays over the K measured presentations: ``times`` (N,), heights (K, N), what was counted and
            measured (K,), ``presented`` (K,); and over the K + 1 moments between them ``density_quantiles``
            (K + 1, Q), ``density_mode`` (K + 1,) and at the first of them ``densities`` (Q, M). Those of
            every learner but the first have its name before theirs.
        """
        arrays: dict[str, Any] = {}
        for place, learner in enumerate(self.learners):
            done, memories = self.run_presentations(experience, repeat, learner)
            found = {
                **stack_presentations([each.record for each in done], [each.numbers for each in done]),
                "presented": np.array([each.presentation.tool for each in done], dtype=np.intp),
                "density_quantiles": np.stack(
                    [memory.belief.compute_percentiles(self.quantiles)[:, 0] for memory in memories]
                ),
                "density_mode": np.array([memory.belief.compute_mode()[0] for memory in memories]),
                "densities": memories[0].belief.compute_percentiles(self.quantiles),
            }
            arrays |= found if place == 0 else {f"{learner.value}: {name}": each for name, each in found.items()}
        return arrays

    def compute_metrics(self, plan: None, experience: Experience | None, arrays: Arrays) -> dict[str, Any]:
        """Computes the numbers of metrics.json; with several learners those of each besides."""
        numbers = compute_numbers(self.numbers, self.measure(arrays))
        if len(self.learners) > 1:
            numbers["learners"] = {
                learner.value: compute_numbers(self.numbers, self.measure(select_learner(arrays, learner, place)))
                for place, learner in enumerate(self.learners)
            }
        return numbers

    def measure(self, arrays: Arrays) -> MeasuredObservers:
        """What was measured, of the arrays of all observers."""
        return MeasuredObservers(self.objects, arrays["presented"], partial(get_measure, arrays, self.quantiles))

    def list_facts(self, plan: None, numbers: Mapping[str, Any]) -> dict[str, Any]:
        """Names of the objects, and how they are presented."""
        *_, before, last = (self.tools[0], *self.tools)
        looks_like = last.components[0].looks_like.name
        config = self.experience
        return {
            "names": [tool.name for tool in self.tools],
            "run_shown": OBSERVER_SHOWN,
            "white_sd": WHITE.sd,
            "first": self.tools[0].name,
            "second": self.tools[min(1, len(self.tools) - 1)].name,
            "duration": self.duration,
            "num_trials": 0 if config is None else config.num_trials,
            "material": self.tools[0].components[0].material.name,
            "decoy_looks_like": "the last one" if last.appearance == before.appearance else looks_like,
            "decoy_materials": " and ".join(dict.fromkeys(part.material.name for part in last.components)),
        }

    def show(self, plan: None, experience: Experience | None, arrays: Arrays, numbers: Mapping[str, Any]) -> Outputs:
        """Figures, trajectories, Diagram and replay."""
        done, _ = self.run_presentations(experience, OBSERVER_SHOWN, self.learners[0])
        held = [(self.tools[each.presentation.tool], each.record) for each in done if each.record is not None]
        figures = draw_figures(self.figures, self.objects, arrays, self.quantiles, self.seed)
        if not held:
            return Outputs(figures=figures)
        seed = (self.seed, OBSERVER_SHOWN, 0)
        study = WithinTrialStudy(self.settings, self.tools[0], duration=self.duration, seed=seed)
        more, writers = draw_within_trial(self.figures, study)
        trial = get_runner(self.settings).get_diagram(self.duration)
        scenes = [Scene(tool, record.times, record.q, f"{tool.name}, {tool.mass:.2f} kg") for tool, record in held]
        names = [self.tools[each.presentation.tool].name for each in done]
        return Outputs(
            figures={**figures, **more},
            trajectories=Trajectories(
                label_results(arrays, self.quantiles, [record for _, record in held]),
                {"trial": names, "joint": trial.arm.joint_names},
            ),
            diagram=lambda: trial.diagram,
            replay=lambda path: write_replay(path, self.settings.arm, scenes, title=f"{self.name}, seed {self.seed}"),
            writers=writers,
        )

    def _begin(
        self, experience: Experience | None, repeat: int, learner: Learner
    ) -> tuple[Memory, list[tuple[int, BlockEntry]]]:
        """The memory of an observer before the first block that is still to run, and these blocks."""
        blocks = list(enumerate(self.blocks))
        if experience is not None:
            return experience.recall(repeat, experience.num_trials), blocks[1:]
        if self.told:
            return MaterialMemory.from_densities(dict(self.told)).add_colours(
                self.colours, self.settings.prior
            ), blocks
        memory = start_memory(learner, (self.seed, repeat, Stream.KINDS))
        return memory.add_colours(self.colours, self.settings.prior), blocks

    def _give_observer(self, memory: Memory, duration: float) -> Observer:
        """An observer of holds; where there is one colour, whatever is seen is of it."""
        remembered = self.colours if len(self.colours) > 1 else ()
        return Observer(get_runner(self.settings), memory, duration=duration, remembered=remembered)

    def _weigh(self, presentation: Presentation) -> Tool:
        """The object of a presentation, as heavy as it is then."""
        tool = self.tools[presentation.tool]
        return tool if presentation.mass is None else weigh(tool, presentation.mass)

    def _present(
        self, block: BlockEntry, tool: Tool, memory: Memory, seed: tuple[int, ...]
    ) -> tuple[TrialRecord, dict[str, Any]]:
        """Presents an object in any way but a hold that teaches."""
        runner = get_runner(self.settings)
        if block.do.clamp is not None:
            record, clamp = run_clamp_and_release(runner, tool, memory, duration=block.do.clamp.duration, seed=seed)
            return record, {"force": clamp.force}
        if block.do.reach is not None:
            path = load_path(find_file(block.do.reach.path, self.section, self.models))
            return present_reach(runner, tool, Reach(path), memory, seed)
        return runner.run_hold(tool, memory, duration=block.do.duration, seed=seed), {}

    def _expect(self, tool: Tool, memory: Memory, seed: tuple[int, ...]) -> dict[str, Any]:
        """What is expected of an object that is seen, if that is asked for: inertial parameters (10,)."""
        numbers: dict[str, Any] = {"weight": tool.mass * get_runner(self.settings).gravity}
        if self.expects:
            rng = np.random.default_rng([*seed, _PREDICTED])
            features = observe(tool, self.settings.feature_source, self.settings.vision_error, rng)
            belief = predict_object(features, memory, self.settings.prior)
            numbers["parameters_predicted"] = belief.compute_parameters(belief.densities.compute_mode())
            numbers["parameters_true"] = tool.parameters
        return numbers
