"""Reads recordings of two robots from clones of public repositories.

Other recordings in these repositories were reserved for an independent check and are not read by any code here.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from affordance.exceptions import BadValueError
from affordance.extensions.payload.recording.run import Run, RunDescription
from affordance.extensions.payload.recording.run_file import read_run
from affordance.extensions.payload.settings import SignalKind
from affordance.extensions.robots.recorded_arm import load_robot
from affordance.plant.serial_chain import SerialChain

_HERE = Path(__file__).parent
_UR10E = Path("dynamic_calibration")
_UR10E_RUNS = _UR10E / "dataset_ur10e" / "identification_data"
_PANDA = Path("FrankaEmikaPandaDynModel/matlab/data/Exciting_Traj/Trajectory_1/rbt_log")
# Mass of the UR10e's load according to its owner, [kg].
UR10E_LOAD = 2.805


class Ur10eData(NamedTuple):
    """Recordings of a UR10e that performs one motion first without a load, then with it."""

    robot: SerialChain
    empty: Run
    loaded: Run


class PandaData(NamedTuple):
    """Recording of a Panda with joint torque sensors and a bare flange."""

    robot: SerialChain
    empty: Run


def load_ur10e(data: Path) -> Ur10eData:
    """Reads the two recordings of the UR10e.

    Raises:
        BadValueError: A file is missing or cannot be read.
        ModelFileError: The URDF describes another arm.
    """
    robot = load_robot(_find(data, _UR10E / "URe" / "urdf" / "ur10e.urdf"), "tool0")
    description = _HERE / "ur10e.yaml"
    name = "ur-20_02_19_14harm50sec"
    empty, loaded = (
        read_run(_find(data, _UR10E_RUNS / f"{name}{ending}.csv"), description) for ending in ("", "Load")
    )
    return Ur10eData(robot, empty, loaded)


def load_panda(data: Path) -> PandaData:
    """Reads the recording of the Panda.

    Raises:
        BadValueError: A file is missing or cannot be read.
    """
    robot = load_robot(_HERE / "panda.urdf", "panda_link8")
    folder = _find(data, _PANDA)
    tables = {}
    for name in ("time", "positions", "velocity", "torques"):
        path = _find(folder, Path(f"exciting_traj_{name}.txt"))
        try:
            tables[name] = np.loadtxt(path).reshape((-1,) if name == "time" else (-1, robot.num_joints))
        except ValueError as error:
            raise BadValueError(path, "", f"must be a column of numbers: {error}") from error
    q, v, tau = (tables[name] for name in ("positions", "velocity", "torques"))
    description = RunDescription(robot.joint_names, SignalKind.JOINT_TORQUE, tip="panda_link8")
    return PandaData(robot, Run(str(folder), description, tables["time"], q, tau, v=v))


def _find(folder: Path, path: Path) -> Path:
    found = folder / path
    if not found.exists():
        problem = (
            f"is missing; --data must contain clones of the repositories by their names, this file of {path.parts[0]}"
        )
        raise BadValueError(found, "", problem)
    return found
