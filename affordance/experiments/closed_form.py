"""Presentations in closed form: forces against a clamp before release, for hundreds of lifts."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from affordance.arrays import Array, Arrays
from affordance.belief.object_belief import Memory
from affordance.experiments.definition import Outputs
from affordance.experiments.shared.experience import Experience
from affordance.experiments.shared.presentation_rows import Presented, see
from affordance.experiments.shared.presented import Means, PresentationExperiment
from affordance.files.netcdf import LabelledArray, Trajectories
from affordance.protocols.presentations import Presentation
from affordance.runs.random_streams import Stream
from affordance.simulation.static_lifts import Lift, StaticLifter


@dataclass(frozen=True)
class ClosedForm(Means):
    """Presentations to the same arm at rest, in closed form."""

    is_closed_form = True
    drawn = ("lifts", "objects")

    def seed_orders(self, seed: int, repeat: int, count: int) -> list[np.random.Generator]:
        """Returns one random generator for all blocks."""
        return [np.random.default_rng([seed, repeat, Stream.LIFT_ORDER])] * count

    def present(
        self, experiment: PresentationExperiment, memory: Memory, drawn: Sequence[Presentation], repeat: int
    ) -> list[Presented]:
        """Lets an observer lift or look at objects."""
        lifts = []
        places: dict[tuple[int, float | None], int] = {}  # lifts of one object that weighs the same are of one tool
        for each in drawn:
            place = places.setdefault((each.tool, each.mass), len(places))
            block = experiment.blocks[each.block]
            lifts.append(Lift(place, block.teaches and block.do.look is None))
        distinct = [experiment.weigh(Presentation(tool, 0, mass)) for tool, mass in places]
        seen = [see(tool) for tool in distinct]
        seed = (experiment.seed, repeat, Stream.LIFT)
        record = StaticLifter(distinct, experiment.settings).run(lifts, memory, seed)
        p_values = record.compute_p_values()
        return [
            Presented(
                each,
                seen[lift.tool],
                (record.memories[number], record.memories[number + 1]),
                record.expected[number],
                p_values[number],
                None,
                {"force": record.force[number], "weight": record.weight[number], "p_value": p_values[number]},
            )
            for number, (each, lift) in enumerate(zip(drawn, lifts, strict=True))
        ]

    def describe_beliefs(self, experiment: PresentationExperiment, memories: Sequence[Memory]) -> dict[str, Array]:
        """Returns mode, and quantiles if requested, of the density of the first material at each moment."""
        modes, quantiles = [], []
        for memory in memories:
            met, colour = memory.recognise(experiment.colours[0], 0.0, experiment.settings.prior)
            modes.append(met.belief.compute_mode()[colour])
            if experiment.quantiles:
                quantiles.append(met.belief.compute_percentiles(experiment.quantiles)[:, colour])
        return {"density_mode": np.array(modes), **({"density_quantiles": np.array(quantiles)} if quantiles else {})}

    def list_facts(self, experiment: PresentationExperiment, numbers: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the numbers of each learner, by its label, and of people."""
        found = numbers.get("learners", {})
        rows = {learner.label: found[learner.value] for learner in experiment.learners if found}
        return {"rows": {**rows, **({"people": numbers["people"]} if numbers.get("people") else {})}}

    def show(self, experiment: PresentationExperiment, experience: Experience | None, arrays: Arrays) -> Outputs:
        """Returns all forces as trajectories."""
        axes = ("observer", "lift")
        variables = {"tool": LabelledArray(axes, arrays["presented"], "1", "place of the object among the names")}
        for learner in experiment.learners:
            meaning = f"upward force before release, {learner.label}"
            force = experiment.select(arrays, learner)["force"]
            variables[f"force_{learner.value}"] = LabelledArray(axes, force, "N", meaning)
        variables["weight"] = LabelledArray(axes, arrays["weight"], "N", "true weight")
        names = [tool.name for tool in experiment.tools]
        return Outputs({}, Trajectories(variables, {"object": names}))
