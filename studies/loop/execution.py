"""Full simulation of what is chosen: the blow with contact, and the reach, on the robot for which it was chosen."""

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
    """Chooses for each task under a memory, and simulates what is chosen with the tool as it is.

    Returns: By task the chosen option; of a blow ``force_error``, the peak resistance over that demanded, less one,
        and ``travel_m``; of a reach ``error_m``, the largest distance of the free end from its path, and tolerance.
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
            except AffordanceError as problem:  # this arm can do none
                found[name] = {"option": option.name, "cannot": str(problem)}
                continue
            error = blow.force / task.force - 1.0
            found[name] = {"option": option.name, "force_error": error, "travel_m": blow.travel}
        elif isinstance(task, Reach):
            motion = roll_out(tool, task, list_densities([tool]), bench.settings)
            found[name] = {"option": option.name, "error_m": motion.error, "tolerance_m": task.path.tolerance}
    return found
