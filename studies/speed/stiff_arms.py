"""Cost of damping on light wrists for an integrator, and remedies.

Arms are folders that ``affordance import-arm`` wrote. Each arm holds the heaviest object of Simulation I, which it
believes to be lighter, for 0.6 s. Errors are those of joint angles, against an accuracy of 1e-8.
"""

import dataclasses
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.control.systems import MpcController
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.plant.arm import ARM
from affordance.plant.arm_model import ArmModel, HeldTorqueModel, compute_stiffness
from affordance.plant.load import load_arm
from affordance.settings import Integrator, Settings
from affordance.simulation.trial import TrialRunner

HEADER = ["arm", "tick over M/D", "torque", "accuracy", "error (rad)", "ticks limited", "times real time"]
_DURATION = 0.6
_ACCURACIES = (1e-2, 1e-3, 1e-4)
_REFERENCE_ACCURACY = 1e-8


def hold(models: Path, accuracy: float, *, holds_torque: bool) -> tuple[Array, int, float]:
    """Simulates the hold; returns angles, (N, num_joints), control periods at a limit, and processor time, [s].

    The controller models its torques as held, or as instantaneous.
    """
    settings = dataclasses.replace(
        Settings(arm=models / ARM.name),
        integrator=Integrator(accuracy=accuracy, stiff_accuracy=accuracy),
        log_period=Settings().control_period,
    )
    tool = load_tools(models / "tools" / "weight.yaml", load_materials(models / "materials.yaml"))[3]
    runner = TrialRunner(settings)
    if not holds_torque:
        _forget_holding(runner.get_diagram(_DURATION).controller)
    runner.run_hold(tool, MaterialMemory(), duration=_DURATION, seed=(0,))
    start = time.process_time()
    record = runner.run_hold(tool, MaterialMemory(), duration=_DURATION, seed=(0,))
    return record.q, record.counts.limited, time.process_time() - start


def _forget_holding(controller: MpcController) -> None:
    """Replaces a controller's model of held torques by the instantaneous equation of motion."""
    held = controller._model
    assert isinstance(held, HeldTorqueModel)
    plain = ArmModel(held.arm)
    controller._model = plain  # type: ignore[assignment]


def measure(arms: Sequence[Path]) -> Iterator[list[str]]:
    """Measures every arm, a folder of models, with both models of torque; yields rows of a table."""
    for models in arms:
        stiffness = compute_stiffness(load_arm(models / ARM.name), Settings().control_period)
        for holds_torque in (False, True):
            reference, _, _ = hold(models, _REFERENCE_ACCURACY, holds_torque=holds_torque)
            for accuracy in _ACCURACIES:
                q, limited, seconds = hold(models, accuracy, holds_torque=holds_torque)
                yield [
                    models.parent.name if models.name == "models" else models.name,
                    f"{stiffness:.0f}",
                    "held" if holds_torque else "instantaneous",
                    f"{accuracy:.0e}",
                    f"{float(np.abs(q - reference).max()):.1e}",
                    f"{limited}",
                    f"{_DURATION / seconds:.1f}",
                ]
