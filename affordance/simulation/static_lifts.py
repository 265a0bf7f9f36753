"""Hundreds of lifts of an observer in closed form: what an arm at rest believes, exerts and feels, none simulated.

In each lift the observer sees an object, pushes with the weight it believes the object to have (``control.clamp``),
and then holds it: the torques of the arm at rest with the object in hand, with the errors of feeling, are what it
learns from. The arm is that of all simulations, in its home posture.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from affordance.arguments import Seed, check_seed
from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.likelihood import Likelihood
from affordance.belief.object_belief import Memory
from affordance.control.clamp import compute_clamp_force
from affordance.exceptions import BadArgumentError
from affordance.objects.appearance import PartAppearance
from affordance.objects.inertia import build_inertia_map
from affordance.objects.tool import Tool
from affordance.plant.arm import load_arm
from affordance.plant.arm_model import ArmModel
from affordance.proprioception.static_hold import StaticHold
from affordance.proprioception.static_percept import StaticPercept
from affordance.proprioception.torque_noise import WeberNoise
from affordance.settings import Settings
from affordance.vision.features import VisionError, measure_features


class Lift(NamedTuple):
    """One presentation of an object.

    Attributes:
        tool: Which object.
        teaches: Whether what is felt is learned from.
    """

    tool: int
    teaches: bool = True


class LiftRecord(NamedTuple):
    """What happened in N lifts.

    Attributes:
        force: Upward force exerted before release, (N,), [N].
        weight: True weight, (N,), [N].
        expected: Mass at the most probable densities before each lift, (N,), [kg].
        memories: Memories before the first and after each lift, N + 1.
        densities: Beliefs about the object before each lift, N of them.
        likelihoods: Likelihoods of these densities; None where nothing was felt, or nothing learned from it.
    """

    force: Array
    weight: Array
    expected: Array
    memories: tuple[Memory, ...]
    densities: tuple[DensityBelief, ...]
    likelihoods: tuple[Likelihood | None, ...]

    def compute_p_values(self) -> Array:
        """Probability of what was felt in each lift, or of what is more surprising, (N,); NaN where nothing was."""
        pairs = zip(self.densities, self.likelihoods, strict=True)
        return np.array([np.nan if found is None else belief.compute_p_value(found) for belief, found in pairs])


class _SeenTool(NamedTuple):
    """What is the same in all lifts of a tool.

    Attributes:
        appearance: What is seen of each part.
        Phi: Inertial parameters at unit density of each part, shape (10, num_parts).
        tau: True torques of the arm that holds it, shape (num_joints,), [N m].
        weight: [N].
    """

    appearance: tuple[PartAppearance, ...]
    Phi: Array
    tau: Array
    weight: float


def check_closed_form(settings: Settings) -> WeberNoise:
    """Returns the noise of settings under which lifts have a closed form: exact features, one percept a trial.

    Raises:
        BadArgumentError: Features are not exact, or joints do not feel by one percept of WeberNoise.
    """
    noise, where = settings.noise, "for lifts in closed form"
    if not isinstance(noise, WeberNoise):
        raise BadArgumentError("Settings", "noise", f"is {type(noise).__name__}, must be WeberNoise {where}")
    if noise.independent_samples:
        raise BadArgumentError("Settings", "noise.independent_samples", f"is true, must be false {where}")
    if settings.vision_error != VisionError():
        raise BadArgumentError("Settings", "vision_error", f"is {settings.vision_error}, must be zero {where}")
    return noise


class StaticLifter:
    """Simulates lifts of a set of objects; what does not change from lift to lift is computed once."""

    def __init__(self, tools: Sequence[Tool], settings: Settings) -> None:
        """Takes the objects and what all simulations share.

        Raises:
            BadArgumentError: The closed form does not hold; see ``check_closed_form``.
            ModelFileError: The arm's file cannot be loaded or does not describe a fit arm.
        """
        self._noise = check_closed_form(settings)
        arm = load_arm(settings.arm)
        self.settings = settings
        self._hold = StaticHold(arm)
        self._gravity = float(np.linalg.norm(ArmModel(arm).gravity))
        self._tools = [self._see(tool) for tool in tools]

    def run(self, lifts: Sequence[Lift], memory: Memory, seed: Seed) -> LiftRecord:
        """Simulates an observer.

        Costs, in each lift, what the memory's ``recall`` and ``learn`` cost.

        Args:
            lifts: The lifts, in their order.
            memory: What the observer remembers before the first.
            seed: Determines the errors of feeling.
        """
        seed = check_seed(seed)
        forces, expected, memories = [], [], [memory]
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
            forces.append(self._compute_force(densities, Phi, rng))
            expected.append(float(Phi[0] @ densities.compute_mode()))
            beliefs.append(densities)
            if lift.teaches:
                percept = self._feel(tool, Phi, (*seed, number))
                lesson = recollection.memory.learn(
                    densities, percept.find_likelihood, self.settings.prior.deviation_sd
                )
                memories.append(lesson.memory)
                likelihoods.append(lesson.likelihood)
            else:
                memories.append(memories[-1])
                likelihoods.append(None)
        weights = [self._tools[lift.tool].weight for lift in lifts]
        return LiftRecord(
            np.array(forces),
            np.array(weights),
            np.array(expected),
            tuple(memories),
            tuple(beliefs),
            tuple(likelihoods),
        )

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

    def _compute_force(self, densities: DensityBelief, Phi: Array, rng: np.random.Generator) -> float:
        rho = densities.compute_point_estimate(self.settings.point_estimate, rng)
        return compute_clamp_force(Phi @ rho, self._gravity)

    def _feel(self, tool: _SeenTool, Phi: Array, seed: tuple[int, ...]) -> StaticPercept:
        gain, offset = self._noise.draw_trial_errors(seed, len(tool.tau))
        felt = tool.tau * (1.0 + gain) + offset
        return StaticPercept(self._hold.tau_arm, self._hold.Y @ Phi, felt - self._hold.tau_arm, self._noise)
