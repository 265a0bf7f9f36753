"""Arguments of the commands for payloads."""

import argparse
from pathlib import Path

from affordance.commands.arguments import add_answer, add_json, add_prior_set, add_robot, add_seed
from affordance.commands.parser import OUTPUT, ROBOT, find_group


def declare_excite(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``excite``."""
    add = parser.add_argument
    add("--for", dest="aim", choices=("mass", "com", "inertia"), default="mass", help="what to identify")
    add("--seconds", type=float, default=8.0, metavar="S", help="duration of the motion (default 8)")
    add("--postures", type=int, metavar="N", help="visit N postures (default: a motion as a Fourier series)")
    add("--mass", type=float, default=1.0, metavar="KG", help="approximate mass of the load (default 1)")
    add(
        "--gains", type=Path, metavar="FILE", help="gains.yaml written by identify, with gains and errors of this arm"
    )
    what = "acceleration limit: one for all joints, or one per joint, rad/s^2 (default: the robot's file, else 3)"
    add("--acceleration", type=float, nargs="+", default=[], metavar="A", help=what)
    add("--tip-speed", type=float, default=1.0, metavar="V", help="speed limit of the tip, m/s (default 1)")
    what = "largest distance of each joint from home (default 3.14)"
    add("--reach", type=float, default=3.14, metavar="RAD", help=what)
    what = "lowest height of the tip above the base's origin, also on the ways from and to home (default 0)"
    add("--above", type=float, default=0.0, metavar="M", help=what)
    add_answer(parser, "motion.csv, trajectory.yaml, excite.json and .txt")
    add_robot(parser)
    add_seed(parser)


def declare_identify(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``identify``."""
    add = parser.add_argument
    what = "model folder of import-arm, a robot's file (URDF, SDF, MJCF), or .dmd.yaml (default: the paper's arm)"
    add("robot", nargs="?", type=Path, help=what)
    robot = find_group(parser, ROBOT).add_argument
    robot("--robot", dest="robot_option", type=Path, metavar="ROBOT", help="the robot, given as an option")
    what = "link that carries the payload, or wrist sensor (default: from the run's description or the model folder)"
    robot("--tip", help=what)
    what = "frame of the controller's flange, for --claimed and payload settings (default: tip in the robot's file)"
    robot("--flange", metavar="NAME", help=what)
    add("--loaded", type=Path, metavar="RUN", help="recording with the load (required, unless --demo)")
    add("--empty", type=Path, nargs="+", default=[], metavar="RUN", help="recordings with an empty hand")
    what = "YAML file that describes all runs (default: for RUN.csv the file RUN.yaml in its folder)"
    add("--description", type=Path, help=what)
    add("--unpaired", action="store_true", help="the loaded run does not repeat the motion of an empty run")
    what = "tools file, or an object's URDF, with the object as a camera saw it; the first tool, unless "
    what += "--object-name names another"
    add("--object", type=Path, help=what)
    add("--object-name", help="name of the tool in that file")
    what = "relative standard deviation of the sizes of the object's parts (default 0.2)"
    add("--size-error", type=float, default=0.2, metavar="SD", help=what)
    what = "relative standard deviation of the mass that the camera does not see (default 0.2; 0.02 for solid stock)"
    add("--unseen", type=float, default=0.2, metavar="SD", help=what)
    what = "materials for the tools file of --object (default: the robot's, else those of the package)"
    add("--materials", type=Path, metavar="FILE", help=what)
    what = "lasting memory of materials (SQLite file), which learns from this run; it is created if it does not exist"
    add("--memory", metavar="MEMORY", help=what)
    what = "mass of the load on a scale, used to calibrate the gains of motor currents"
    add("--reference-mass", type=float, metavar="KG", help=what)
    add("--gains", type=Path, help="known gains (gains.yaml, written by a run with --reference-mass)")
    what = "YAML files with payload settings of the controller, to compare with the result"
    add("--claimed", type=Path, nargs="+", default=[], metavar="FILE", help=what)
    add("--anyway", action="store_true", help="write, learn and print settings even if the result is not trusted")
    what = "leave out samples of a joint while it is slower than this, rad/s (default 0.03)"
    add("--min-speed", type=float, help=what)
    what = "cut-off of the low-pass filter, Hz, for example live's value (default: four times the motion's bandwidth)"
    add("--cutoff", type=float, metavar="HZ", help=what)
    add("--samples", type=int, default=32_000, help="number of posterior samples (default 32000)")
    add(
        "--demo",
        action="store_true",
        help="identify the payload in a simulated recording that comes with the program",
    )
    add_answer(parser, "belief.json, samples.npz, gains.yaml and figures")
    _add_write(parser)
    add_seed(parser)
    add_prior_set(parser)


def declare_weigh(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``weigh``."""
    add = parser.add_argument
    what = "table (CSV) of poses at rest: fx fy fz in N (kgf would give a mass 9.8 times too small), tx ty tz in N m"
    add("poses", type=Path, metavar="POSES", help=f"{what}, and an orientation")
    forms = "quaternion, matrix, rpy, rotation_vector, gravity or accelerometer"
    add("--orientation", default="", metavar="FORM", help=f"form to use if the table has several: {forms}")
    what = "axes of the wrench (default: the axes with more evidence)"
    add("--axes", choices=("sensor", "base"), default="", help=what)
    what = "body on which the measured wrench acts (default: the body with more evidence)"
    add("--force-on", choices=("robot", "object"), default="", help=what)
    what = "direction in which gravity pulls, in the base's axes (default 0 0 -1)"
    add("--gravity", type=float, nargs=3, default=[0.0, 0.0, -1.0], metavar=("X", "Y", "Z"), help=what)
    add("--frame", default="sensor", metavar="NAME", help="name of the sensor's frame, for files (default sensor)")
    add_answer(parser, "weighing.json and .txt")
    _add_write(parser)
    add_seed(parser)


def declare_compare_payloads(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``compare-payloads``."""
    what = "JSON of identify, weigh or a final event of live, or YAML with mass, com, inertia and frame"
    parser.add_argument("first", type=Path, metavar="A", help=what)
    parser.add_argument("second", type=Path, metavar="B", help="the same for the other payload")
    add = find_group(parser, ROBOT).add_argument
    add("--robot", type=Path, metavar="ROBOT", help="robot's file, if the payloads are in different frames of it")
    add_json(parser)


def declare_feed_forward(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``feed-forward``."""
    what = "model folder of import-arm, or a robot's file (default: the paper's arm)"
    parser.add_argument("robot", nargs="?", type=Path, help=what)
    what = "link that carries the payload (default: the frame that the payload's file names)"
    find_group(parser, ROBOT).add_argument("--tip", default="", help=what)
    add = parser.add_argument
    what = (
        "JSON of identify, weigh or a final event of live, or YAML with mass, com, inertia and frame (default: none)"
    )
    add("--payload", type=Path, metavar="FILE", help=what)
    add("--posture", type=float, nargs="+", metavar="RAD", help="angle of each joint, rad (required)")
    what = "relative SD of the weight of each link in the robot's file (default 0.1)"
    add("--link-error", type=float, default=0.1, metavar="SD", help=what)
    what = "direction in which gravity pulls, in the base's axes (default 0 0 -1)"
    add("--gravity", type=float, nargs=3, default=[0.0, 0.0, -1.0], metavar=("X", "Y", "Z"), help=what)
    add_json(parser)


def _add_write(parser: argparse.ArgumentParser) -> None:
    """Adds ``--write`` and ``--draws``; see ``payload_file.write_payload``."""
    add = find_group(parser, OUTPUT).add_argument
    what = "file for the payload as a link: .urdf, .sdf, .xml (MJCF) or .json"
    add("--write", type=Path, metavar="FILE", help=what)
    what = "also write N bodies drawn from the posterior, as FILE with a number (with --write)"
    add("--draws", type=int, default=0, metavar="N", help=what)


def declare_live(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``live``."""
    add = parser.add_argument
    add(
        "robot", nargs="?", type=Path, help="model folder of import-arm, or a robot's file (default: the paper's arm)"
    )
    robot = find_group(parser, ROBOT).add_argument
    robot("--tip", help="link that carries the payload (default: from the first empty run or the model folder)")
    what = "frame of the controller's flange, for payload settings (default: the tip in the robot's file)"
    robot("--flange", metavar="NAME", help=what)
    what = "recordings with an empty hand, preferably three of 15 s; --record makes them"
    add("--empty", type=Path, nargs="+", default=[], metavar="RUN", help=what)
    what = "YAML file that describes these runs (default: for RUN.csv the file RUN.yaml in its folder)"
    add("--description", type=Path, help=what)
    add("--gains", type=Path, help="known gains (gains.yaml, written by identify with --reference-mass)")
    source = parser.add_argument_group("source of samples (default: JSON lines, or a table, on standard input)")
    source = source.add_mutually_exclusive_group()
    source.add_argument(
        "--ros2",
        metavar="TOPIC",
        help="joint states of ROS 2, such as /joint_states, in the domain ROS_DOMAIN_ID; needs no ROS",
    )
    source.add_argument("--rtde", metavar="HOST[:PORT]", help="a Universal Robots controller")
    source.add_argument("--replay", type=Path, nargs="+", metavar="RUN", help="recordings, one after the other")
    what = "recordings of the package; or fr3, a robot in another process, simulated by MuJoCo"
    source.add_argument("--demo", nargs="?", const="bar", choices=("bar", "fr3"), help=what)
    add("--seconds", type=float, metavar="S", help="end after S seconds of the stream")
    what = "kind of signal if there are no empty runs (default joint_torque)"
    add("--signal", choices=("joint_torque", "motor_torque", "current"), default="joint_torque", help=what)
    output = find_group(parser, OUTPUT).add_argument
    output("--record", type=Path, metavar="DIR", help="folder for the stream, stored as recordings for identify")
    output("--json", action="store_true", help="print each event as a line of JSON")
    parser.set_defaults(object=None, robot_option=None)
