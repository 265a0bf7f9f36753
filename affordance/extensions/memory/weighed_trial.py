"""Builds trials for a lasting memory from tools that were weighed."""

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from affordance.belief.likelihood import Quadratic
from affordance.exceptions import show_text
from affordance.extensions.memory.felt_models import PayloadQuadratic, pack
from affordance.extensions.memory.trial_evidence import TrialEvidence
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.objects.tool import Tool
from affordance.vision.eye import measure_drawing
from affordance.vision.prediction import measure_geometry

# Name that takes the place of a robot's.
SCALE = "a scale"


def list_weighed_trials(tools: Iterable[Tool], path: Path) -> Iterator[TrialEvidence]:
    """Lists one trial for each weighing of tools from a file.

    A weighing is of a whole tool, or of some of its parts, which then count as an object of their own. It measures
    only the first of the ten parameters, the mass. A memory counts it once, however often it is added.
    """
    for tool in tools:
        features = measure_drawing(tool)
        for weighing in tool.weighings:
            chosen = weighing.parts or tuple(range(len(features)))
            parts = [features[k] for k in chosen]
            shown = f"part {', '.join(str(k + 1) for k in chosen)} of {tool.name}" if weighing.parts else tool.name
            precision, information = np.zeros((NUM_PARAMETERS, NUM_PARAMETERS)), np.zeros(NUM_PARAMETERS)
            precision[0, 0], information[0] = weighing.sd**-2, weighing.mass * weighing.sd**-2
            yield TrialEvidence(
                object_name=shown,
                parts=tuple(part.appearance for part in parts),
                geometry=measure_geometry(parts, range(len(parts)), len(parts)),
                model=PayloadQuadratic(),
                features=pack(Quadratic(precision, information)),
                num_samples=1,
                num_joints=1,
                robot=SCALE,
                source=show_text(path.name),
            )
