"""``affordance excite``: designs a motion that shows a payload well, before anything is recorded."""

import argparse
import importlib
from pathlib import Path

from affordance.commands.options import add_robot, add_seed, add_set
from affordance.files.model_folder import MODELS

SIGNALS = ("joint_torque", "motor_torque")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add = parser.add_argument
    add("--for", dest="aim", default="mass", metavar="AIM", help="mass, com, inertia, or a task (default mass)")
    add("--seconds", type=float, default=8.0, metavar="S", help="length of the motion (default 8)")
    add("--postures", type=int, metavar="N", help="visit N postures (default: a Fourier series)")
    add("--mass", type=float, default=1.0, metavar="KG", help="about what the load weighs (default 1)")
    add("--tools", type=Path, default=MODELS / "workshop" / "tools.yaml", metavar="FILE", help="tools, for a task")
    add("--only", metavar="NAME", help="tool of it that will be held (default: the first)")
    add("--signal", choices=SIGNALS, default=SIGNALS[0], help="what will be recorded (default joint_torque)")
    add("--gains", type=Path, metavar="FILE", help="gains.yaml of identify, with gains and errors of this arm")
    add("--floor", type=float, default=10.0, metavar="G", help="error that no time averages out (default 10 g)")
    add("--acceleration", type=float, default=3.0, metavar="A", help="limit of each joint, rad/s^2 (default 3)")
    add("--tip-speed", type=float, default=1.0, metavar="V", help="limit of the tip's speed, m/s (default 1)")
    add("--reach", type=float, default=3.14, metavar="RAD", help="farthest from home, each joint (default 3.14)")
    add("--above", type=float, metavar="M", help="least height of the tip in the base frame (default: none)")
    add("--json", action="store_true", help="print the result as JSON")
    add("--out", type=Path, metavar="DIR", help="folder for motion.csv, trajectory.yaml, excite.json and .txt")
    add_robot(parser)
    add_seed(parser)
    add_set(parser)


def run(arguments: argparse.Namespace) -> int:
    """Prints what the motion is predicted to show, and writes the motion."""
    # Imported on demand: it takes a second, for which --help need not wait.
    status: int = importlib.import_module("affordance.commands.excite_motion").run(arguments)
    return status
