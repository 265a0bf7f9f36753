"""Compares other methods with ours on the development recordings: error, stated interval, coverage and time.

All methods get the same samples, gains and load friction. The recordings are the halves of a UR10e's pair, each with
gains from the other half, and a Panda's recording with payloads injected into its windows.
"""

import contextlib
import io
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy

from affordance.arrays import Array
from affordance.identification.evidence.evidence import Evidence
from affordance.identification.evidence.gains import Gains
from affordance.identification.evidence.paired_runs import pair_runs
from affordance.identification.posterior.calibration import calibrate_gains
from affordance.identification.posterior.inference import infer
from affordance.identification.settings import DEFAULT_SETTINGS
from affordance.objects.inertia import NUM_PARAMETERS, pseudo_inertia_from_parameters
from studies.recorded.clones import UR10E_LOAD, load_panda, load_ur10e
from studies.recorded.panda import PandaStudy
from studies.recorded.peers import TO_90, eliminate_friction, solve_least_squares, solve_semidefinite
from studies.study import import_part

# Ball of 1 kg and 5 cm from which MuJoCo's optimiser starts, and bounds of its coordinates about that start.
_START = np.array([1.0, 0.0, 0.0, 0.0, 1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0])
_BOUND = 10.0
_WINDOW = 5  # duration of the Panda's windows, [s]


class Estimate(NamedTuple):
    """Estimated mass, [kg], with the half-width of its 90 % interval; NaN if the method states none."""

    mass: float
    half90: float


class Task(NamedTuple):
    """Samples, with the true mass of the load, [kg]."""

    evidence: Evidence
    gains: Gains
    mass: float


def compare(data: Path, num_windows: int, seed: int) -> dict[str, Any]:
    """Compares all methods on the recordings in a folder of clones; returns results by recording and method."""
    methods: dict[str, Callable[[Evidence, Gains], Estimate]] = {
        "least squares": _solve_least_squares,
        "semidefinite program": _solve_semidefinite,
        "mujoco.sysid": _solve_mujoco,
        "ours": _infer,
    }
    import_part("mujoco.sysid._src.parameter", "peers")
    tasks = {
        "UR10e, halves of a pair": list(_list_halves(data)),
        "Panda, 5 s": list(_inject(data, num_windows, seed)),
    }
    return {
        recording: {name: _measure(method, of_recording) for name, method in methods.items()}
        for recording, of_recording in tasks.items()
    }


def _measure(method: Callable[[Evidence, Gains], Estimate], tasks: list[Task]) -> dict[str, float]:
    errors, halves, seconds = [], [], []
    for task in tasks:
        start = time.process_time()
        estimate = method(task.evidence, task.gains)
        seconds.append(time.process_time() - start)
        errors.append(estimate.mass - task.mass)
        halves.append(estimate.half90)
    inside = np.abs(errors) <= np.array(halves)
    return {
        "rms_error_g": 1e3 * float(np.sqrt(np.mean(np.square(errors)))),
        "stated90_g": 1e3 * float(np.mean(halves)),
        "inside": float(inside.mean()) if np.isfinite(halves).all() else float("nan"),
        "number": len(tasks),
        "seconds": float(np.median(seconds)),
    }


def _list_halves(data: Path) -> Iterator[Task]:
    recorded = load_ur10e(data)
    evidence = pair_runs(recorded.robot, recorded.empty, recorded.loaded, DEFAULT_SETTINGS)
    middle = len(evidence.prepared.times) // 2
    halves = evidence.select(slice(middle)), evidence.select(slice(middle, None))
    for half, other in (halves, halves[::-1]):
        gains = calibrate_gains(other, UR10E_LOAD, DEFAULT_SETTINGS).with_drift(DEFAULT_SETTINGS)
        yield Task(half, gains, UR10E_LOAD)


def _inject(data: Path, number: int, seed: int) -> Iterator[Task]:
    study = PandaStudy(load_panda(data), DEFAULT_SETTINGS)
    for payload, evidence, _ in study.draw(_WINDOW, DEFAULT_SETTINGS, number, seed):
        yield Task(evidence, study.gains, float(payload[0]))


def _solve_least_squares(evidence: Evidence, gains: Gains) -> Estimate:
    found = solve_least_squares(evidence, gains, with_load_friction=True)
    return Estimate(float(found.parameters[0]), TO_90 * found.mass_sd)


def _solve_semidefinite(evidence: Evidence, gains: Gains) -> Estimate:
    return Estimate(float(solve_semidefinite(evidence, gains).parameters[0]), float("nan"))


def _infer(evidence: Evidence, gains: Gains) -> Estimate:
    belief = infer(evidence, gains)
    low, high = belief.mass_interval90
    return Estimate(belief.mass, 0.5 * (high - low))


def _solve_mujoco(evidence: Evidence, gains: Gains) -> Estimate:
    """Fits the body with the coordinates, the optimiser and the intervals of mujoco.sysid.

    The torques come from our regressor, which agrees with MuJoCo's inverse dynamics; friction is eliminated.
    """
    sysid, modifier = (import_part(name, "peers") for name in ("mujoco.sysid", "mujoco.sysid._src.model_modifier"))
    A, b = eliminate_friction(evidence, gains, with_load_friction=True)
    # The same sum of squares, condensed to one row for each unknown and one row for the residual that no body
    # explains.
    _, R = np.linalg.qr(np.column_stack([A, b]))
    W, y = R[:, :NUM_PARAMETERS], R[:, NUM_PARAMETERS]
    start = modifier.theta_from_pseudoinertia(pseudo_inertia_from_parameters(_START))

    def convert(theta: Array) -> Array:
        """Converts MuJoCo's coordinates to the ten parameters."""
        found = modifier.pi_from_theta(theta)
        of_tip = found[4:].reshape(3, 3)
        pi: Array = np.concatenate([found[:4], np.diag(of_tip), of_tip[[0, 0, 1], [1, 2, 2]]])
        return pi

    def compute_mass(theta: Array) -> float:
        return float(convert(theta)[0])

    def compute_residual(theta: Array, _: Any) -> tuple[list[Array], None, None]:
        return [W @ convert(np.asarray(theta).ravel()) - y], None, None

    parameters = sysid.ParameterDict({"body": sysid.Parameter("body", start, start - _BOUND, start + _BOUND)})
    with contextlib.redirect_stdout(io.StringIO()):  # the optimiser prints every step
        _, result = sysid.optimize(parameters, compute_residual, optimizer="scipy", verbose=False)
    theta = np.asarray(result.x)
    residual, *_ = compute_residual(theta, None)
    # Interval under white errors, with the true number of samples rather than that of the condensed rows above.
    variance = float(residual[0] @ residual[0]) / (len(b) - NUM_PARAMETERS)
    covariance = variance * np.linalg.pinv(result.jac.T @ result.jac)
    slope = scipy.optimize.approx_fprime(theta, compute_mass, 1e-7)
    return Estimate(compute_mass(theta), TO_90 * float(np.sqrt(slope @ covariance @ slope)))


def list_rows(found: dict[str, Any]) -> Iterator[list[str]]:
    """Lists the rows of the table."""
    for recording, methods in found.items():
        for name, each in methods.items():
            stated = "none" if np.isnan(each["stated90_g"]) else f"{each['stated90_g']:.0f}"
            inside = "" if np.isnan(each["inside"]) else f"{each['inside']:.2f} of {each['number']:.0f}"
            yield [recording, name, f"{each['rms_error_g']:.0f}", stated, inside, f"{each['seconds']:.3f}"]
