"""Compares several design rules for moving while weighing, in numbers and figures."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.objects.materials import MATERIALS, load_materials
from affordance.objects.tool import list_densities
from affordance.proprioception.torque_noise import WeberNoise
from affordance.robots.robot import Robot
from affordance.settings import Settings
from studies.excite import motions, posewise
from studies.excite.figure import draw_errors
from studies.recorded.clones import LBIPE_OBJECTS, load_panda, load_ur10e, load_weighed_objects
from studies.study import run_kept

_TOOL = "claw hammer"
NUM_POSTURES = 200


def check_recordings(data: Path) -> None:
    """Reads the recordings in order to check them.

    Raises:
        BadValueError: A file is missing or cannot be read.
        ModelFileError: The URDF describes another arm.
    """
    for load in (load_weighed_objects, load_panda, load_ur10e):
        load(data)


def measure_motions(
    data: Path, folder: Path, *, pools: int, designs: int, seed: int, jobs: int
) -> tuple[dict[str, Any], dict[str, Callable[[], Figure]]]:
    """Evaluates rules for postures and motions; returns numbers for metrics.json and functions that draw figures."""
    files = sorted(path for path in data.rglob("*") if path.suffix in (".npz", ".csv", ".txt", ".urdf"))

    def run[C](config: C, measure: Callable[[C, int], Mapping[str, NDArray[Any]]], repeats: int, name: str) -> Any:
        return run_kept(config, measure, folder, files, repeats=repeats, jobs=jobs, description=f"active: {name}")

    of_poses = {
        rule: [
            run(posewise.PosewiseConfig(str(data), name, rule, seed), posewise.run_pool, pools, f"{name}, {rule}")
            for name in LBIPE_OBJECTS
        ]
        for rule in posewise.RULES
    }
    of_motions = {
        arm: {
            rule: run(
                motions.MotionConfig(str(data), arm, rule, motions.list_seconds(rule), seed),
                motions.run_motions,
                designs,
                f"{arm}, {rule}",
            )
            for rule in motions.RULES
        }
        for arm in motions.ARMS
    }
    numbers = describe(of_poses, posewise.NUMBERS, of_motions, motions.LONG_SECONDS)
    numbers["excite"] |= {"pools": pools, "designs": designs, "weighing": weigh_in_postures()}
    poses = {"weighed objects": numbers["excite"]["poses"]["rules"]}
    arms = {arm: numbers["excite"][arm]["rules"] for arm in motions.ARMS}
    keys = {"found": "rmse_g", "said": "said_sd_g"}
    return numbers, {
        "poses": partial(draw_errors, posewise.NUMBERS, poses, **keys, label="postures"),
        "motions": partial(draw_errors, motions.LONG_SECONDS, arms, **keys, label="time (s)"),
    }


def describe(
    of_poses: Mapping[str, list[dict[str, NDArray[Any]]]],
    numbers: tuple[int, ...],
    of_motions: Mapping[str, Mapping[str, Mapping[str, NDArray[Any]]]],
    seconds: tuple[float, ...],
) -> dict[str, Any]:
    """Summarises the results with postures and motions; the top-level numbers are those that claims use."""
    poses = posewise.describe_posewise(of_poses, numbers)
    arms = {arm: motions.describe_motions(rules, seconds) for arm, rules in of_motions.items()}
    return {
        "poses_as_8_random": poses["poses_as_8_random"],
        "worse_with_more": poses["worse_with_more"],
        "inside_90": poses["inside_90"],
        "seconds_over_random": max(each["seconds_over_random"] for each in arms.values()),
        "largest_share_of_a_limit": float(max(each["largest_share_of_a_limit"] for each in arms.values())),
        "predicted_over_stated": float(np.mean([each["predicted_over_stated"] for each in arms.values()])),
        "excite": {"poses": poses, **arms},
    }


def weigh_in_postures(num_postures: int = NUM_POSTURES) -> dict[str, Any]:
    """Computes the standard deviation of a hammer's mass from one hold in each of several random postures, [g].

    The hammer's shape is known, but the densities of its parts are not.
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
    rng = np.random.default_rng(0)
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
