"""Hundreds of lifts of an observer in closed form: belief, exerted force and measurements of an arm at rest.

In each lift the observer sees an object, pushes with the believed weight of the object (``control.hold``), and then
holds it: the observer learns from the torques of the arm at rest with the object in hand, with measurement errors.
The arm is that of all simulations, in its home posture; nothing is simulated.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from affordance.arguments import Seed, check_seed
from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.likelihood import Likelihood
from affordance.belief.object_belief import Memory
from affordance.exceptions import BadArgumentError
from affordance.objects.appearance import PartAppearance
from affordance.objects.inertia import build_inertia_map
from affordance.objects.tool import Tool
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.proprioception.static_hold import StaticHold, StaticPercept
from affordance.proprioception.torque_noise import WeberNoise
from affordance.settings import Settings
from affordance.vision.eye import measure_features
from affordance.vision.features import VisionError


class Lift(NamedTuple):
    """Presentation of an object, by its index, from which the observer may learn."""

    tool: int
    teaches: bool = True


class LiftRecord(NamedTuple):
    """Record of N lifts."""

    force: Array  # upward force exerted before release, (N,), [N]
    weight: Array  # true weight, (N,), [N]
    expected: Array  # expected mass, at the most probable densities before each lift, (N,), [kg]
    felt: (
        Array  # weight at the most probable densities given what was felt in the lift too, (N,), [N]; NaN if nothing
    )
    memories: tuple[Memory, ...]  # memories before the first lift and after each lift, N + 1 of them
    densities: tuple[DensityBelief, ...]  # beliefs about the object before each lift, N of them
    # Likelihoods of these densities, N of them; None for a lift from which nothing is learned.
    likelihoods: tuple[Likelihood | None, ...]

    def compute_p_values(self) -> Array:
        """Computes the p-value of the measurement of each lift, (N,); NaN for a lift without one."""
        pairs = zip(self.densities, self.likelihoods, strict=True)
        return np.array([np.nan if found is None else belief.compute_p_value(found) for belief, found in pairs])


class _SeenTool(NamedTuple):
    """Quantities that all lifts of a tool share; Phi is that of its parts, (10, num_parts), the weight in [N]."""

    appearance: tuple[PartAppearance, ...]
    Phi: Array
    tau: Array  # true torques of the arm holding the tool, shape (num_joints,), [N m]
    weight: float


def check_closed_form(settings: Settings) -> WeberNoise:
    """Returns the torque noise; raises a BadArgumentError unless features are exact, with one error per trial."""
    noise, where = settings.noise, "for lifts in closed form"
    if not isinstance(noise, WeberNoise):
        raise BadArgumentError("Settings", "noise", f"is {type(noise).__name__}, must be WeberNoise {where}")
    if noise.independent_samples:
        raise BadArgumentError("Settings", "noise.independent_samples", f"is true, must be false {where}")
    if settings.vision_error != VisionError():
        raise BadArgumentError("Settings", "vision_error", f"is {settings.vision_error}, must be zero {where}")
    return noise


class StaticLifter:
    """Observer's lifts of a set of objects in closed form; quantities shared by all lifts are computed once."""

    def __init__(self, tools: Sequence[Tool], settings: Settings) -> None:
        """Computes what does not change between lifts; errors are those of ``check_closed_form`` and ``load_arm``."""
        self._noise = check_closed_form(settings)
        arm = load_arm(settings.arm)
        self.settings = settings
        self._hold = StaticHold(arm)
        self._gravity = float(np.linalg.norm(ArmModel(arm).gravity))
        self._tools = [self._see(tool) for tool in tools]

    def run(self, lifts: Sequence[Lift], memory: Memory, seed: Seed) -> LiftRecord:
        """Computes the lifts of one observer, with a seed of the measurement errors.

        The computing time of each lift is that of the memory's ``recall`` and ``learn``.
        """
        seed = check_seed(seed)
        forces, expected, felt, memories = [], [], [], [memory]
        beliefs: list[DensityBelief] = []
        likelihoods: list[Likelihood | None] = []
        for number, lift in enumerate(lifts, start=1):  # a seed that ends in 0 is the same without it
            tool = self._tools[lift.tool]
            recollection = memories[-1].recall(tool.appearance, self.settings.prior)
            densities = recollection.densities
            columns = np.zeros((len(recollection.columns), densities.size))
            columns[np.arange(len(recollection.columns)), list(recollection.columns)] = 1.0
            Phi = tool.Phi @ columns  # (10, M)
            rng = np.random.default_rng([*seed, number, 1])
            rho = densities.compute_point_estimate(self.settings.point_estimate, rng)
            forces.append(float((Phi @ rho)[0]) * self._gravity)
            expected.append(float(Phi[0] @ densities.compute_mode()))
            beliefs.append(densities)
            if lift.teaches:
                percept = self._feel(tool, Phi, (*seed, number))
                lesson = recollection.memory.learn(
                    densities, percept.find_likelihood, self.settings.prior.deviation_sd
                )
                memories.append(lesson.memory)
                likelihoods.append(lesson.likelihood)
                felt.append(float(Phi[0] @ lesson.densities.compute_mode()) * self._gravity)
            else:
                memories.append(memories[-1])
                likelihoods.append(None)
                felt.append(np.nan)
        weights = np.array([self._tools[lift.tool].weight for lift in lifts])
        learned = (tuple(memories), tuple(beliefs), tuple(likelihoods))
        return LiftRecord(np.array(forces), weights, np.array(expected), np.array(felt), *learned)

    def _see(self, tool: Tool) -> _SeenTool:
        features = measure_features(tool, self.settings.vision_error, np.random.default_rng(0))  # exact
        count = len(features)
        Phi = build_inertia_map(
            [part.shape for part in features], [part.X_TE for part in features], range(count), count
        )
        return _SeenTool(
            tuple(part.appearance for part in features),
            Phi,
            self._hold.tau_arm + self._hold.Y @ tool.parameters,
            self._gravity * tool.mass,
        )

    def _feel(self, tool: _SeenTool, Phi: Array, seed: tuple[int, ...]) -> StaticPercept:
        gain, offset = self._noise.draw_trial_errors(seed, len(tool.tau))
        felt = tool.tau * (1.0 + gain) + offset
        return StaticPercept(self._hold.tau_arm, self._hold.Y @ Phi, felt - self._hold.tau_arm, self._noise)
