"""``affordance identify``: identifies a robot's payload from recordings."""

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from affordance.arguments import check_number, check_whole
from affordance.belief.density_belief import Prior
from affordance.belief.kind_memory import KindMemory
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.memory_file import read_memory, read_taught, write_memory
from affordance.commands.options import add_set, change_by_name, check_bounds, list_groups, refuse_changes
from affordance.commands.payload_text import describe_payload
from affordance.exceptions import BadValueError
from affordance.files.atomic import to_plain, write_json, write_text
from affordance.files.model_folder import MODELS
from affordance.files.netcdf import LabelledArray, Trajectories, write_trajectories
from affordance.identification.evidence.gains import read_gains, write_gains
from affordance.identification.identify import Runs, check_reference_mass, identify, see_tool
from affordance.identification.payload_claim import TOLERANCE, judge_claim
from affordance.identification.payload_formats import format_payload, read_payload
from affordance.identification.posterior.part_posterior import SeenObject
from affordance.identification.posterior.payload_belief import PayloadBelief
from affordance.identification.recording.robot_chain import RobotChain
from affordance.identification.recording.run import Run
from affordance.identification.recording.run_file import read_run
from affordance.identification.settings import MIN_SPEED, NUM_SAMPLES, IdentificationSettings
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.reporting.figures import save_figure
from affordance.reporting.payload_figures import draw_fit, draw_posteriors, draw_whiteness
from affordance.robots.recorded_arm import load_robot

HELP = "identify what a robot held: mass, centre of mass, inertia, with intervals, from recordings"
# Nuisances that can be switched off, named as in the settings.
NUISANCES = ("gains", "load-friction", "friction", "tare", "floor", "correlated-noise")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add = parser.add_argument
    add("robot", type=Path, help="URDF, SDF or MJCF file of the robot, or Drake model directives (.dmd.yaml)")
    add("--tip", help="link that carries the payload, or the wrist sensor (default: the run's description)")
    add("--base", help="link in which gravity is given (default: the run's description, or as far as joints go)")
    add("--loaded", type=Path, required=True, metavar="RUN", help="recording with the load")
    add("--empty", type=Path, nargs="+", default=[], metavar="RUN", help="recordings with an empty hand")
    add(
        "--description",
        type=Path,
        help="YAML file that describes all runs (default: the file of the same name in the folder of each run)",
    )
    add("--unpaired", action="store_true", help="the loaded run repeats none of the empty ones")
    add(
        "--object", type=Path, help="tools file with what a camera saw of the object, its first tool or --object-name"
    )
    add("--object-name", help="which tool of that file")
    add(
        "--object-pose",
        type=float,
        nargs=6,
        metavar=("X", "Y", "Z", "ROLL", "PITCH", "YAW"),
        help="pose of the object in the tip, m and degrees (default: the run's description)",
    )
    add(
        "--size-error", type=float, default=0.2, metavar="SD", help="of the sizes of its parts, relative (default .2)"
    )
    add("--materials", type=Path, default=MODELS / "materials.yaml", help="materials of that file")
    add(
        "--memory", type=Path, help="JSON file of learned densities, which learns from this run; new if there is none"
    )
    add("--learned", type=Path, help="where the memory is written (default: back to --memory)")
    add("--reference-mass", type=float, metavar="KG", help="what the load weighs on a scale: finds gains of currents")
    add("--gains", type=Path, help="gains found before (gains.yaml of a run with --reference-mass)")
    add("--claimed", type=Path, metavar="FILE", help="payload that is set on the controller (docs/identify.md)")
    add("--tolerance", type=float, default=TOLERANCE, help="of its mass and centre of mass, relative (default .05)")
    add("--anyway", action="store_true", help="write, teach and print lines though the result is not to be trusted")
    add("--off", nargs="+", default=[], choices=NUISANCES, help="nuisances to leave out")
    add("--min-speed", type=float, help="leave out samples of a joint slower than this, rad/s (default 0.03)")
    add("--samples", type=int, default=IdentificationSettings().num_samples, help="of the posterior (default 32000)")
    add("--seed", type=int, default=0, help="of the samples (default 0)")
    add("--out", type=Path, help="folder for belief.json, samples.nc, gains.yaml and figures (default: none)")
    add("--json", action="store_true", help="print the belief as JSON")
    add_set(parser)


def run(arguments: argparse.Namespace) -> int:
    """Identifies the payload, and prints and writes the result.

    Returns: 0, or 3 if the result is not to be trusted.

    Raises:
        AffordanceError: An argument, a file or a recording is invalid.
    """
    settings = _build_settings(arguments)
    refuse_changes(arguments, list_groups(except_for="prior"), "of all settings a seen object has the prior's only")
    prior = change_by_name(arguments).prior
    loaded = read_run(arguments.loaded, arguments.description)
    empty = tuple(read_run(path, arguments.description) for path in arguments.empty)
    if arguments.object_pose is not None:
        loaded = _place_object(loaded, arguments.object_pose)
    robot = _load_robot(arguments, loaded)
    gains = None if arguments.gains is None else read_gains(arguments.gains)
    claimed = None if arguments.claimed is None else read_payload(arguments.claimed)
    taught, memory = _recall(arguments.memory)
    seen = None if arguments.object is None else _see(arguments, memory, prior)
    mass = arguments.reference_mass
    if mass is not None:
        check_reference_mass("--reference-mass", mass)
    belief = identify(
        robot,
        Runs(loaded, empty),
        paired=not arguments.unpaired,
        gains=gains,
        reference_mass=mass,
        seen=seen,
        deviation_sd=prior.deviation_sd,
        settings=settings,
    )
    is_used = belief.is_trusted or arguments.anyway
    content = belief.to_dict()
    if is_used and belief.setting is not None:
        content["payload_settings"] = format_payload(belief.setting)
    claim = None
    if claimed is not None:
        claim = claimed, judge_claim(belief, claimed, arguments.tolerance)
        content["claimed"] = {"verdict": claim[1].verdict, **claim[1]._asdict(), **claimed._asdict()}
    lesson = _teach(arguments, belief, loaded, taught)
    text = describe_payload(belief, claim, taught=lesson, anyway=arguments.anyway)
    if arguments.out is not None:
        _write(arguments.out, belief, content, text, is_used)
    print(json.dumps(to_plain(content), indent=2) if arguments.json else text)
    return 0 if belief.is_trusted else 3


def _recall(path: Path | None) -> tuple[tuple[str, ...], MaterialMemory | KindMemory]:
    """Reads which runs taught a memory, and the memory; a file that does not exist yet is a new memory."""
    if path is None or (not path.exists() and path.parent.is_dir()):
        return (), MaterialMemory()
    return read_taught(path), read_memory(path)


def _teach(arguments: argparse.Namespace, belief: PayloadBelief, run: Run, taught: tuple[str, ...]) -> str:
    """Writes what the run teaches; returns a sentence about it, or none without a memory."""
    path = arguments.learned or arguments.memory
    if belief.seen is None or path is None:
        return ""
    if run.fingerprint in taught:
        return f"{path} learns nothing: this run has taught it before"
    if not belief.teaches and not arguments.anyway:
        reason = "the result is not to be trusted" if belief.doubts else "the object is not what it looks like"
        return f"{path} learns nothing: {reason} (--anyway teaches it)"
    write_memory(path, belief.seen.memory, (*taught, run.fingerprint))
    return f"{path} has learned them"


def _place_object(run: Run, values: Sequence[float]) -> Run:
    """Returns the run with the pose of the seen object in the tip: position, [m], roll, pitch and yaw, [deg]."""
    for name, value in zip(("X", "Y", "Z", "ROLL", "PITCH", "YAW"), values, strict=True):
        bound = 2.0 if len(name) == 1 else 360.0
        check_number(f"--object-pose {name}", value, -bound, bound)
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", values[3:], degrees=True).as_matrix()
    pose[:3, 3] = values[:3]
    return replace(run, description=replace(run.description, object_pose=pose))


def _build_settings(arguments: argparse.Namespace) -> IdentificationSettings:
    check_bounds(arguments)
    check_whole("--samples", arguments.samples, NUM_SAMPLES)
    settings = IdentificationSettings(num_samples=arguments.samples, seed=arguments.seed)
    if arguments.min_speed is not None:
        check_number("--min-speed", arguments.min_speed, MIN_SPEED.low, MIN_SPEED.high, "rad/s")
        settings = replace(settings, min_speed=arguments.min_speed)
    off = {name.replace("-", "_"): False for name in arguments.off}
    return replace(settings, **off)  # type: ignore[arg-type]


def _load_robot(arguments: argparse.Namespace, loaded: Run) -> RobotChain:
    tip = arguments.tip or loaded.description.tip
    if not tip:
        raise BadValueError("--tip", "", "is missing, and the run's description names no tip either")
    return load_robot(arguments.robot, tip, arguments.base or loaded.description.base or None)


def _see(arguments: argparse.Namespace, memory: MaterialMemory | KindMemory, prior: Prior) -> SeenObject:
    check_number("--size-error", arguments.size_error, 0.0, 1.0)
    tools = load_tools(arguments.object, load_materials(arguments.materials))
    named = {tool.name: tool for tool in tools}
    name = arguments.object_name or tools[0].name
    if name not in named:
        raise BadValueError("--object-name", "", f"is {name!r}, must be one of {', '.join(named)}")
    return see_tool(named[name], memory, prior, arguments.size_error)


def _write(folder: Path, belief: PayloadBelief, content: dict[str, object], text: str, is_used: bool) -> None:
    save_figure(draw_fit(belief.fit), folder, "fit")
    save_figure(draw_posteriors(belief), folder, "posteriors")
    save_figure(draw_whiteness(belief.fit), folder, "whiteness")
    if belief.calibration is not None and is_used:
        write_gains(folder / "gains.yaml", belief.calibration)
    meaning = "mass, first moment, moments and products of inertia about the tip"
    samples = Trajectories(
        {
            "parameters": LabelledArray(("sample", "parameter"), belief.bodies.pi, "kg, kg m, kg m^2", meaning),
            "weight": LabelledArray(("sample",), belief.bodies.weights, "1", "weight of a sample, sum one"),
        },
        {"parameter": ["m", "mx", "my", "mz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"]},
    )
    write_trajectories(folder / "samples.nc", samples)
    write_text(folder / "belief.txt", text + "\n")
    write_json(folder / "belief.json", content)
