"""Protocols of many lifts in closed form: forces against a clamp before release, for each learner and for people.

Linear+ and Linear++ (Cesanek and others 2021) are two of them, models/protocols/linear_plus.yaml and
linear_plus_plus.yaml.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from affordance.arrays import Array
from affordance.belief.kinds_summary import count_kinds
from affordance.belief.learner import Learner
from affordance.belief.learners import KAPPA, start_memory
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import Memory
from affordance.experiments.definition import Arrays, Outputs
from affordance.experiments.shared.experience import Experience
from affordance.experiments.shared.hold_outputs import draw_figures
from affordance.experiments.shared.lift_drawings import draw_lift_figures
from affordance.experiments.shared.presentation_rows import describe_presentation, see, stack_rows
from affordance.experiments.shared.presented import LABELS, PresentedExperiment
from affordance.files.netcdf import LabelledArray, Trajectories
from affordance.protocols.presentations import Presentation, draw_presentations
from affordance.runs.random_streams import Stream
from affordance.simulation.static_lifts import Lift, StaticLifter


@dataclass(frozen=True)
class LiftExperiment(PresentedExperiment):
    """Experiment of a protocol of lifts in closed form.

    Attributes:
        kappa: Breadth of a category relative to its mean; None for the fitted value.
    """

    kappa: float | None = None

    is_closed_form = True
    drawn = ("lifts", "objects")

    def gain_experience(self, folder: Any, *, repeats: int, jobs: int) -> None:
        """Does nothing, as all learning happens in the lifts."""

    def draw_presentations(self, repeat: int) -> list[Presentation]:
        """Draws an observer's lifts, the same for each learner."""
        rng = np.random.default_rng([self.seed, repeat, Stream.LIFT_ORDER])
        return [
            presentation
            for index, block in enumerate(self.blocks)
            for presentation in draw_presentations(block, index, self.objects, rng, repeat)
        ]

    def run_learner(self, experience: Experience | None, repeat: int) -> Arrays:
        """Runs one observer with the first learner.

        Returns: Arrays over the K measured lifts: ``presented``, the index of the lifted object, ``force`` and
            ``weight``, [N], ``founds_a_kind`` and ``p_value``, (K,); over the K + 1 moments between them
            ``density_mode`` and ``density_quantiles`` (K + 1, Q) of the first material; and rows of all lifts.
        """
        drawn = self.draw_presentations(repeat)
        lifts = []
        places: dict[tuple[int, float | None], int] = {}  # lifts of one object that weighs the same are of one tool
        for each in drawn:
            place = places.setdefault((each.tool, each.mass), len(places))
            block = self.blocks[each.block]
            lifts.append(Lift(place, block.teaches and block.do.look is None))
        distinct = [self.weigh(Presentation(tool, 0, mass)) for tool, mass in places]
        seen = [see(tool) for tool in distinct]
        lifter = StaticLifter(distinct, self.settings)
        record = lifter.run(lifts, self._start(self.learners[0], repeat), (self.seed, repeat, Stream.LIFT))
        p_values = record.compute_p_values()
        rows = [
            describe_presentation(
                each,
                seen[lift.tool],
                (record.memories[number], record.memories[number + 1]),
                prior=self.settings.prior,
                force=record.force[number],
                expected=record.expected[number],
                p_value=p_values[number],
            )
            for number, (each, lift) in enumerate(zip(drawn, lifts, strict=True))
        ]
        measured = np.array([self.blocks[each.block].measured for each in drawn])
        kinds = np.array([count_kinds(memory) for memory in record.memories])
        moments = [record.memories[each] for each in [0, *(1 + np.flatnonzero(measured))]]
        return {
            "presented": np.array([each.tool for each in drawn], dtype=np.intp)[measured],
            "force": record.force[measured],
            "weight": record.weight[measured],
            "founds_a_kind": np.diff(kinds)[measured] > 0,
            "p_value": p_values[measured],
            **self._describe_beliefs(moments),
            **stack_rows(rows),
        }

    def _describe_beliefs(self, memories: list[Memory]) -> dict[str, Array]:
        """Computes mode, and quantiles if requested, of the density of the first material at each moment."""
        modes, quantiles = [], []
        for memory in memories:
            met, colour = memory.recognise(self.colours[0], 0.0, self.settings.prior)
            modes.append(met.belief.compute_mode()[colour])
            if self.quantiles:
                quantiles.append(met.belief.compute_percentiles(self.quantiles)[:, colour])
        return {"density_mode": np.array(modes), **({"density_quantiles": np.array(quantiles)} if quantiles else {})}

    def assemble(self, learners: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
        """Assembles the numbers of the first learner, with ``learners``, ``people`` and ``kappa``."""
        kappa = {learner.value: KAPPA[learner.pick] for learner in self.learners if learner.pick is not None}
        people = self.describe_people()
        return {**learners[self.learners[0].value], "learners": dict(learners), "people": people, "kappa": kappa}

    def list_facts(self, plan: None, numbers: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the names of objects and learners."""
        return {
            "names": [tool.name for tool in self.tools],
            "rows": {
                **{LABELS[each]: numbers["learners"][each.value] for each in self.learners},
                **({"people": numbers["people"]} if numbers["people"] else {}),
            },
        }

    def show(self, plan: None, experience: Experience | None, arrays: Arrays, numbers: Mapping[str, Any]) -> Outputs:
        """Returns the figures that the protocol asks for, all forces, and lifts.csv."""
        axes = ("observer", "lift")
        variables = {"tool": LabelledArray(axes, arrays["presented"], "1", "place of the object among the names")}
        for learner in self.learners:
            meaning = f"upward force before release, {LABELS[learner]}"
            force = self.select(arrays, learner)["force"]
            variables[f"force_{learner.value}"] = LabelledArray(axes, force, "N", meaning)
        variables["weight"] = LabelledArray(axes, arrays["weight"], "N", "true weight")
        return Outputs(
            figures={**draw_figures(self, arrays), **draw_lift_figures(self, arrays)},
            trajectories=Trajectories(variables, {"object": [tool.name for tool in self.tools]}),
            writers={"lifts": partial(self.write_presentations, arrays)},
        )

    def _start(self, learner: Learner, repeat: int) -> Memory:
        if self.told:
            return MaterialMemory.from_densities(dict(self.told))
        return start_memory(learner, (self.seed, repeat, Stream.KINDS), self.kappa)
