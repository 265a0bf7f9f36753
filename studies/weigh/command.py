"""``affordance study weigh``: measures the coverage of ``affordance weigh`` and of least squares."""

import argparse
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.commands.arguments import add_jobs, add_out, add_repeats, add_seed
from affordance.extensions.payload.weighing.poses import FORMS, read_poses
from affordance.extensions.payload.weighing.weigh import weigh
from affordance.extensions.payload.weighing.wrench_model import GRAVITY
from studies.study import Findings, Study, Work, format_table, run_kept
from studies.weigh.simulated import SimulatedPoses, simulate_poses

_FORM_NAMES = tuple(FORMS)
_GROUPS = {"mass": slice(0, 1), "centre of mass": slice(1, 4)}
_RESAMPLES = 2000  # of the tables, for intervals over tables


@dataclass(frozen=True)
class WeighConfig:
    """Configuration of the study."""

    seed: int = 0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_repeats(parser, 200, "simulated tables of poses")
    add_seed(parser)
    add_jobs(parser)
    add_out(parser)


def plan(arguments: argparse.Namespace) -> Work:
    """Plans the simulated tables."""
    return partial(_simulate, arguments)


def run_table(config: WeighConfig, repeat: int) -> Mapping[str, NDArray[Any]]:
    """Weighs the load of one simulated table.

    Returns: Errors, SDs, and True if the 50 and 90 % intervals contain the truth.
    """
    simulated = simulate_poses(config.seed, repeat)
    with tempfile.TemporaryDirectory() as folder:
        poses = read_poses(simulated.write(Path(folder) / "poses.csv"))
    weighing = weigh(poses)
    truth = np.array([simulated.mass, *simulated.centre])
    ends, mean = weighing.intervals[:4], np.array([weighing.mass, *weighing.centre_of_mass])
    plain, plain_sd, freedom = solve_least_squares(simulated, poses.wrench, poses.down_S)
    held = [np.abs(truth - plain) <= scipy.special.stdtrit(freedom, p) * plain_sd for p in (0.75, 0.95)]
    return {
        "level": np.array([repeat % len(FORMS), simulated.noise, simulated.num, simulated.axes == "base"]),
        "error": mean - truth,
        "sd": weighing.sd[:4],
        "held": np.array([(ends[:, a] <= truth) & (truth <= ends[:, a + 1]) for a in (0, 2)]),
        "plain_error": plain - truth,
        "plain_held": np.array(held),
        "read_right": np.array(weighing.axes == simulated.axes),
        "doubted": np.array(bool(weighing.doubts)),
    }


def solve_least_squares(simulated: SimulatedPoses, wrench: Array, down_S: Array) -> tuple[Array, Array, Array]:
    """Estimates mass and centre of mass with ordinary least squares, with known axes.

    Returns: The estimates, their SDs, and their degrees of freedom.
    """
    g = GRAVITY * down_S
    if simulated.axes == "base":
        wrench = np.column_stack([simulated.rotations.inv().apply(part) for part in np.split(wrench, 2, axis=1)])
    offset = np.tile(np.eye(3), (len(g), 1))
    of_moment = np.stack([np.cross(axis, g) for axis in np.eye(3)], axis=2).reshape(-1, 3)
    solved = []
    for X, y in ((g.reshape(-1, 1), wrench[:, :3]), (of_moment, wrench[:, 3:])):
        A = np.column_stack([X, offset])
        b, freedom = np.linalg.lstsq(A, y.ravel())[0], len(A) - A.shape[1]
        variance = float(np.sum((y.ravel() - A @ b) ** 2)) / freedom
        solved.append((b, variance * np.linalg.inv(A.T @ A), freedom))
    (b, cov, freedom), (moment, of_moments, freedoms) = solved
    centre = moment[:3] / b[0]
    of_centre = np.diagonal(of_moments)[:3] + cov[0, 0] * centre**2
    sd = np.array([np.sqrt(cov[0, 0]), *np.sqrt(of_centre) / abs(b[0])])
    return np.array([abs(b[0]), *centre]), sd, np.array([freedom, *[freedoms] * 3])


def _simulate(arguments: argparse.Namespace, folder: Path) -> Iterator[Findings]:
    config = WeighConfig(arguments.seed)
    run = run_kept(config, run_table, folder, [], repeats=arguments.repeats, jobs=arguments.jobs, description="weigh")
    yield Findings(tabulate(run) | {"repeats": arguments.repeats, "seed": arguments.seed})


def tabulate(run: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    """Prints and returns coverage for each noise, number of poses and form of orientation."""
    level = run["level"]
    numbers: dict[str, Any] = {"tables": len(level)}
    numbers |= {name: float(run[name].mean()) for name in ("read_right", "doubted")}
    rows = []
    factors = {"all": np.zeros(len(level)), "form": level[:, 0], "noise_n": level[:, 1], "poses": level[:, 2]}
    numbers["coverage"] = {}
    for factor, values in factors.items():
        for value in np.unique(values):
            chosen = values == value
            shown = _FORM_NAMES[int(value)] if factor == "form" else f"{value:g}"
            name = factor if factor == "all" else f"{factor} {shown}"
            cells: dict[str, Any] = {"tables": int(chosen.sum())}
            for group, part in _GROUPS.items():
                for kind in ("held", "plain_held"):
                    of_tables = run[kind][chosen][:, :, part].mean(axis=2)
                    low, high = _resample(np.mean, of_tables[:, 1])
                    cells[f"{kind} {group}"] = [*of_tables.mean(axis=0).tolist(), low, high]
            rows.append([name, str(cells["tables"]), *(_show(each) for each in list(cells.values())[1:])])
            numbers["coverage"][name] = cells
    scaled = run["error"] / run["sd"]
    numbers["rms_error_in_sds"] = np.sqrt((scaled**2).mean(axis=0)).tolist()
    for kind in ("error", "plain_error"):
        numbers[f"median_{kind}"] = np.median(np.abs(run[kind]), axis=0).tolist()
    numbers["error_ratio"] = {
        group: [_compare_errors(errors), *_resample(_compare_errors, errors)]
        for group, part in _GROUPS.items()
        for errors in [np.abs(np.stack([run["error"][:, part], run["plain_error"][:, part]], axis=-1))]
    }
    header = [
        "coverage at 50, 90 % [95 % interval]",
        "tables",
        "mass",
        "least squares",
        "centre of mass",
        "least squares",
    ]
    print(format_table(header, rows))
    print(f"axes read right in {numbers['read_right']:.3f}, doubted {numbers['doubted']:.3f}")
    for group, (ratio, low, high) in numbers["error_ratio"].items():
        print(f"median error of the {group} over that of least squares: {ratio:.2f} [{low:.2f}, {high:.2f}]")
    return numbers


def _compare_errors(errors: Array) -> float:
    """Computes the ratio of the median errors of ``weigh``, ``errors[..., 0]``, and of least squares."""
    ours, plain = np.median(errors, axis=tuple(range(errors.ndim - 1)))
    return float(ours / plain)


def _resample(statistic: Callable[[Array], Any], of_tables: Array) -> list[float]:
    """Computes the 95 % bootstrap interval of a statistic over tables, the first axis."""
    rng = np.random.default_rng(0)
    drawn = [statistic(of_tables[rng.integers(len(of_tables), size=len(of_tables))]) for _ in range(_RESAMPLES)]
    return [float(bound) for bound in np.quantile(drawn, (0.025, 0.975))]


def _show(cell: list[float]) -> str:
    half, ninety, low, high = cell
    return f"{half:.2f} {ninety:.2f} [{low:.2f}, {high:.2f}]"


STUDY = Study("coverage of loads weighed by a wrist sensor, in simulated tables of poses", add_arguments, plan)
