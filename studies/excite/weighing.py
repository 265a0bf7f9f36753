"""Postures in which the simulated arm weighs a hammer at rest, with the noise of the observers."""

from typing import Any

import numpy as np

from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.objects.materials import MATERIALS, load_materials
from affordance.objects.tool import list_densities
from affordance.proprioception.torque_noise import WeberNoise
from affordance.robots.robot import Robot
from affordance.settings import Settings

_TOOL = "claw hammer"
NUM_POSTURES = 200


def weigh_in_postures(num_postures: int = NUM_POSTURES, seed: int = 0) -> dict[str, Any]:
    """Computes the standard deviation of a hammer's mass by one hold in random postures, [g].

    Its form is known, the densities of its parts are not.
    """
    robot, noise = Robot(), WeberNoise()
    tools = {each.name: each for each in load_tools(MODELS / "workshop" / "tools.yaml", load_materials(MATERIALS))}
    tool = next(iter(tools[_TOOL].list_gripped().values()))
    pi, densities = tool.parameters, list_densities([tool])
    Phi = np.array(
        [
            (tool.with_densities({**densities, colour: 2.0 * density}).parameters - pi) / density
            for colour, density in densities.items()
        ]
    ).T
    limits = robot.limits
    rng = np.random.default_rng(seed)
    q = rng.uniform(limits.q_lower, limits.q_upper, (num_postures, len(robot.home)))
    q = np.concatenate([robot.home[None], q])
    rest = np.zeros_like(q)
    Y = robot.chain.compute_payload_regressors(q, rest, rest)
    torque = robot.chain.compute_arm_torques(q, rest, rest) + Y @ pi
    A = (Y @ Phi) / np.sqrt(noise.threshold**2 + (noise.weber_fraction * torque) ** 2)[..., None]
    prior = np.eye(len(densities)) / Settings().prior.sd ** 2
    covariance = np.linalg.inv(A.transpose(0, 2, 1) @ A + prior)
    sd = 1e3 * np.sqrt(np.einsum("i,nij,j->n", Phi[0], covariance, Phi[0]))
    sd = np.where((np.abs(torque) <= limits.tau_max).all(axis=1), sd, np.inf)
    return {"home_g": sd[0], "median_g": np.median(sd[1:]), "best_g": sd[1:].min(), "over_home": sd[1:].min() / sd[0]}
