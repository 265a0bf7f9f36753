"""Protocols with simulated presentations: objects are held, released from a clamp, moved or looked at.

Simulations I and II of the paper (IV-A and IV-B) are two of them, models/protocols/weight.yaml and com.yaml.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from affordance.belief.kinds_summary import count_kinds
from affordance.belief.learner import Learner
from affordance.belief.learners import start_memory
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import Memory
from affordance.choice.reach import Reach
from affordance.control.timed_path import TimedPath
from affordance.experiments.definition import OBSERVER_SHOWN, Arrays, Outputs
from affordance.experiments.shared.experience import Experience, ExperienceConfig, build_experience
from affordance.experiments.shared.gain_experience import collect_experience
from affordance.experiments.shared.hold_outputs import draw_figures, label_results
from affordance.experiments.shared.lift_drawings import draw_lift_figures
from affordance.experiments.shared.presentation_rows import (
    PresentationRow,
    describe_experience,
    describe_presentation,
    expect_mass,
    see,
    stack_rows,
)
from affordance.experiments.shared.presented import PresentedExperiment
from affordance.experiments.shared.reaching import present_reach
from affordance.experiments.shared.trajectories import stack_presentations
from affordance.experiments.within_trial import WHITE, WithinTrialStudy, draw_within_trial
from affordance.files.netcdf import Trajectories
from affordance.objects.tool import Tool
from affordance.protocols.block_entries import BlockEntry, change_holds
from affordance.protocols.object_entries import ProtocolObjects
from affordance.protocols.presentations import Presentation, draw_presentations
from affordance.reporting.replay import Scene, write_replay
from affordance.runs.random_streams import Stream
from affordance.simulation.clamp_trial import run_clamp_and_release
from affordance.simulation.trial import Observer, get_runner
from affordance.simulation.trial_record import TrialRecord
from affordance.vision.observe import observe
from affordance.vision.visual_prior import predict_object

_PREDICTED = 9  # in a seed, for objects observed and not held; the draws of a trial count from 0


class Presented(NamedTuple):
    """Presentations to one observer of one learner.

    Attributes:
        done: Measured presentations, K of them.
        memories: Memories before the first of these and after each, K + 1.
        rows: Rows of all presentations.
    """

    done: "list[Done]"
    memories: list[Memory]
    rows: list[PresentationRow]


class Done(NamedTuple):
    """Measured presentation to an observer.

    Attributes:
        presentation: Presentation that was carried out.
        record: Record of the motion; None if the object was only looked at.
        numbers: Further measures, by name.
    """

    presentation: Presentation
    record: TrialRecord | None
    numbers: Mapping[str, Any]


@dataclass(frozen=True)
class HoldExperiment(PresentedExperiment):
    """Experiment of a protocol with simulated presentations.

    Attributes:
        expects: True to store the inertial parameters that an observer predicts from sight.
        paths: Paths of reaches, by the index of their block.
    """

    expects: bool = False
    paths: Mapping[int, TimedPath] = field(default_factory=dict)

    drawn = (
        "objects",
        "heights",
        "heights of points",
        "density and drop",
        "lifts",
        "belief within a trial",
        "sinking",
    )

    @property
    def tools_observed(self) -> tuple[Tool, ...]:
        """All objects, as the camera sees each of them."""
        return self.tools

    @property
    def duration(self) -> float:
        """Duration of a hold in the last block with holds, [s]."""
        return next((block.do.duration for block in self.blocks[::-1] if block.do.duration), 0.0)

    @property
    def experience(self) -> ExperienceConfig | None:
        """Experience gained in an unmeasured first block, which protocols share; None without such a block."""
        return build_experience(self.blocks[0], self.objects, self.learners, self.told, self.seed, self.settings)

    def with_tools(self, tools: Sequence[Tool], groups: Mapping[str, Sequence[int]]) -> "HoldExperiment":
        """Returns the experiment with other objects."""
        return replace(self, objects=ProtocolObjects(tuple(tools), groups, self.objects.path))

    def with_duration(self, duration: float, repetitions: int | None = None) -> "HoldExperiment":
        """Returns the experiment with holds of another duration, [s], and other repetitions of the first block."""
        return replace(self, blocks=change_holds(self.blocks, duration, repetitions))

    def gain_experience(self, folder: Path, *, repeats: int, jobs: int) -> Experience | None:
        """Lets observers learn in a first block that is not measured; returns None without such a block."""
        config = self.experience
        return None if config is None else collect_experience(config, folder, repeats=repeats, jobs=jobs)

    def run_test_pass(self, memory: Memory, repeat: int) -> list[TrialRecord]:
        """Presents the objects of all blocks but the first under the given memory; returns the records."""
        presented = self._run_blocks(memory, list(enumerate(self.blocks))[1:], repeat)
        return [each.record for each in presented.done if each.record is not None]

    def draw_presentations(self, repeat: int) -> list[Presentation]:
        """Draws the presentations of an observer, block by block."""
        return [
            presentation
            for index, block in enumerate(self.blocks)
            for presentation in self._draw_block(index, block, repeat)
        ]

    def _draw_block(self, index: int, block: BlockEntry, repeat: int) -> list[Presentation]:
        rng = np.random.default_rng([self.seed, repeat, Stream.ORDER, *([index] if index else [])])
        return draw_presentations(block, index, self.objects, rng, repeat)

    def run_presentations(self, experience: Experience | None, repeat: int, learner: Learner) -> Presented:
        """Runs one observer of a learner."""
        memory, blocks = self._begin(experience, repeat, learner)
        return self._run_blocks(memory, blocks, repeat)

    def _run_blocks(self, memory: Memory, blocks: Sequence[tuple[int, BlockEntry]], repeat: int) -> Presented:
        """Runs the given blocks."""
        presented = Presented([], [memory], [])
        taught, tested = 0, 0
        for index, block in blocks:
            observer: Observer | None = None
            for presentation in self._draw_block(index, block, repeat):
                tool, before = self.weigh(presentation), memory
                seed = (self.seed, repeat, taught) if block.teaches else (self.seed, repeat, Stream.TEST, tested)
                numbers = self._expect(tool, memory, seed) if block.measured else {}
                record: TrialRecord | None = None
                if block.do.hold is not None and block.teaches:
                    observer = observer or self._give_observer(memory, block.do.duration)
                    record = observer.hold(tool, seed)
                elif block.do.look is None:
                    record, more = self._present(index, tool, memory, seed)
                    numbers |= more
                if block.teaches and record is not None:
                    memory = observer.memory if observer is not None else record.memory
                taught, tested = taught + block.teaches, tested + (not block.teaches)
                seen = see(tool)
                row = describe_presentation(
                    presentation,
                    seen,
                    (before, memory),
                    prior=self.settings.prior,
                    force=numbers.get("force", np.nan),
                    expected=expect_mass(seen, before, self.settings),
                    p_value=np.nan if record is None else record.p_value,
                )
                presented.rows.append(row)
                if block.measured:
                    numbers |= {"founds_a_kind": count_kinds(memory) > count_kinds(before)}
                    presented.done.append(Done(presentation, record, numbers))
                    presented.memories.append(memory)
        return presented

    def run_learner(self, experience: Experience | None, repeat: int) -> Arrays:
        """Runs one observer with the first learner.

        Returns: Arrays over the K measured presentations: ``times`` (N,), heights (K, N), counts and measures (K,),
            ``presented`` (K,); over the K + 1 moments between them ``density_quantiles`` (K + 1, Q) and
            ``density_mode`` (K + 1,), and at the first moment ``densities`` (Q, M); and rows of all presentations,
            whose names begin with ROW.
        """
        done, memories, rows = self.run_presentations(experience, repeat, self.learners[0])
        if experience is not None:
            config = self.experience
            assert config is not None  # or there would be none
            places = self.objects.groups[self.blocks[0].objects]
            rows = [*describe_experience(config, experience, places, repeat), *rows]
        return {
            **stack_presentations([each.record for each in done], [each.numbers for each in done]),
            "presented": np.array([each.presentation.tool for each in done], dtype=np.intp),
            "density_quantiles": np.stack(
                [memory.belief.compute_percentiles(self.quantiles)[:, 0] for memory in memories]
            ),
            "density_mode": np.array([memory.belief.compute_mode()[0] for memory in memories]),
            "densities": memories[0].belief.compute_percentiles(self.quantiles),
            **stack_rows(rows),
        }

    def list_facts(self, plan: None, numbers: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the names of the objects and the conditions of their presentation."""
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
        """Returns figures, trajectories, Diagram, replay and lifts.csv."""
        done = self.run_presentations(experience, OBSERVER_SHOWN, self.learners[0]).done
        held = [(self.tools[each.presentation.tool], each.record) for each in done if each.record is not None]
        figures = {**draw_figures(self, arrays), **draw_lift_figures(self, arrays)}
        lifts = {"lifts": partial(self.write_presentations, arrays)}
        if not held:
            return Outputs(figures=figures, writers=lifts)
        seed = (self.seed, OBSERVER_SHOWN, 0)
        study = WithinTrialStudy(self.settings, self.tools[0], duration=self.duration, seed=seed)
        more, writers = draw_within_trial(self.figures, study)
        trial = get_runner(self.settings).get_diagram(self.duration)
        scenes = [Scene(tool, record.times, record.q, f"{tool.name}, {tool.mass:.2f} kg") for tool, record in held]
        return Outputs(
            figures={**figures, **more},
            trajectories=Trajectories(
                label_results(arrays, self.quantiles, [each.record for each in done]),
                {"trial": [self.tools[each.presentation.tool].name for each in done], "joint": trial.arm.joint_names},
            ),
            diagram=lambda: trial.diagram,
            replay=lambda path: write_replay(path, self.settings.arm, scenes, title=f"{self.name}, seed {self.seed}"),
            writers={**lifts, **writers},
        )

    def _begin(
        self, experience: Experience | None, repeat: int, learner: Learner
    ) -> tuple[Memory, list[tuple[int, BlockEntry]]]:
        """Returns the memory of an observer before the first block still to run, and the remaining blocks."""
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
        """Builds an observer of holds; where all objects share one colour, everything it sees is taken to have it."""
        remembered = self.colours if len(self.colours) > 1 else ()
        return Observer(get_runner(self.settings), memory, duration=duration, remembered=remembered)

    def _present(
        self, index: int, tool: Tool, memory: Memory, seed: tuple[int, ...]
    ) -> tuple[TrialRecord, dict[str, Any]]:
        """Presents an object of a block in any way except a hold that teaches."""
        runner, action = get_runner(self.settings), self.blocks[index].do
        if action.clamp is not None:
            record, clamp = run_clamp_and_release(runner, tool, memory, duration=action.duration, seed=seed)
            return record, {"force": clamp.force}
        if action.reach is not None:
            return present_reach(runner, tool, Reach(self.paths[index]), memory, seed)
        return runner.run_hold(tool, memory, duration=action.duration, seed=seed), {}

    def _expect(self, tool: Tool, memory: Memory, seed: tuple[int, ...]) -> dict[str, Any]:
        """Returns an object's weight, [N], and, if requested, its predicted and true inertial parameters, (10,)."""
        numbers: dict[str, Any] = {"weight": tool.mass * get_runner(self.settings).gravity}
        if self.expects:
            rng = np.random.default_rng([*seed, _PREDICTED])
            features = observe(tool, self.settings.feature_source, self.settings.vision_error, rng)
            belief = predict_object(features, memory, self.settings.prior)
            numbers["parameters_predicted"] = belief.compute_parameters(belief.densities.compute_mode())
            numbers["parameters_true"] = tool.parameters
        return numbers
