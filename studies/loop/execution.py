"""Simulates chosen options, the blow with contact and the reach, on the robot that chose them."""

from typing import Any

import numpy as np

from affordance.belief.material_memory import MaterialMemory
from affordance.choice.demand import Criterion
from affordance.choice.hammer import Hammer
from affordance.choice.ranking import rank_draws
from affordance.choice.reach import Reach
from affordance.exceptions import AffordanceError
from affordance.objects.tool import list_densities
from affordance.plant.arm_model import ArmModel
from affordance.simulation.blow import simulate_blow
from affordance.simulation.rollout import roll_out
from studies.loop.study import Bench

_SAMPLES = 1000


def execute(bench: Bench, memory: MaterialMemory, criterion: Criterion, seed: int) -> dict[str, Any]:
    """Chooses an option for each task from a memory, and simulates it with the true tool.

    Returns:
        Chosen option by task. For a blow also ``force_error``, the peak resistance divided by the required one, minus
        one, and ``travel_m``, the nail's travel. For a reach also ``error_m``, the free end's largest distance from
        its path, and the tolerance.
    """
    found: dict[str, Any] = {}
    tools = {tool.name: tool for tool in bench.tools}
    for name, task in bench.tasks.items():
        choice, rng = bench.choices[name], np.random.default_rng(seed)
        ranking = rank_draws(choice, choice.draw(memory, rng, _SAMPLES), rng, criterion=criterion)
        option = ranking.ranked[0].option
        tool = tools[option.object_name].list_gripped()[option.grip]
        if isinstance(task, Hammer):
            planned = task.build_cost(ArmModel(bench.robot.arm), tool.components, bench.settings)
            try:
                blow = simulate_blow(tool, task, planned, list_densities([tool]), bench.settings)
            except AffordanceError as problem:  # this arm has no usable option
                found[name] = {"option": option.name, "cannot": str(problem)}
                continue
            error = blow.force / task.force - 1.0
            found[name] = {"option": option.name, "force_error": error, "travel_m": blow.travel}
        elif isinstance(task, Reach):
            motion = roll_out(tool, task, list_densities([tool]), bench.settings)
            found[name] = {"option": option.name, "error_m": motion.error, "tolerance_m": task.path.tolerance}
    return found
