"""Work of ``affordance identify``: reads its files, identifies the payload, prints and writes it."""

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy

from affordance.arguments import check_number, check_whole
from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import Memory
from affordance.commands.demo import ARM_FILE, EMPTY, LOADED, MASS, PIECE, STOCK, announce, check_alone
from affordance.commands.options import change_by_name, check_bounds, list_groups, refuse_changes
from affordance.commands.payload_text import describe_payload
from affordance.exceptions import BadValueError
from affordance.files.atomic import to_plain, write_json, write_text
from affordance.identification.evidence.gains import read_gains, write_gains
from affordance.identification.identify import Runs, check_reference_mass, identify, see_tool
from affordance.identification.payload_claim import judge_claim
from affordance.identification.payload_formats import format_payload, read_payload
from affordance.identification.posterior.part_posterior import SeenObject
from affordance.identification.posterior.payload_belief import PayloadBelief
from affordance.identification.recording.run import Run
from affordance.identification.recording.run_file import read_run
from affordance.identification.settings import MIN_SPEED, NUM_SAMPLES, IdentificationSettings
from affordance.memory.identified_trial import build_identified_trial
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.objects.tool import Tool
from affordance.plant.load import HAND_FRAME
from affordance.plant.serial_chain import SerialChain
from affordance.robots.recorded_arm import load_robot


def run(arguments: argparse.Namespace) -> int:
    """Identifies the payload, prints and writes the result; returns 0, or 3 if it is not to be trusted."""
    if arguments.demo:
        return _run_demo(arguments)
    if arguments.loaded is None:
        raise BadValueError("--loaded", "", "is missing, must be a recording with the load (or --demo)")
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
    memory = _recall(arguments.memory, prior)
    tool = None if arguments.object is None else _find_tool(arguments)
    seen = None if tool is None else see_tool(tool, memory, prior, arguments.size_error)
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
    lesson = ""
    if tool is not None and seen is not None and (arguments.learned or arguments.memory):
        belief, lesson = _teach(arguments, belief, seen, robot, loaded, tool.name, settings, prior)
    is_used = belief.is_trusted or arguments.anyway
    content = belief.to_dict()
    if is_used and belief.setting is not None:
        content["payload_settings"] = format_payload(belief.setting)
    claim = None
    if claimed is not None:
        claim = claimed, judge_claim(belief, claimed, arguments.tolerance)
        content["claimed"] = {"verdict": claim[1].verdict, **claim[1]._asdict(), **claimed._asdict()}
    materials = {each.name: each.colour for each in load_materials(arguments.materials).values()} if seen else {}
    text = describe_payload(belief, claim, materials=materials, taught=lesson, anyway=arguments.anyway)
    if arguments.out is not None:
        _write(arguments.out, belief, content, text, is_used)
    print(json.dumps(to_plain(content), indent=2) if arguments.json else text)
    return 0 if belief.is_trusted else 3


def _run_demo(arguments: argparse.Namespace) -> int:
    """Identifies the recording that comes with the package."""
    options = ("loaded", "empty", "object", "description", "tip", "base")
    check_alone(arguments, {"robot": "a robot", "robot_option": "--robot"} | {each: f"--{each}" for each in options})
    words = [ARM_FILE, "--empty", EMPTY, "--loaded", LOADED, "--object", STOCK, "--object-name", PIECE]
    announce(["identify", *words, "--size-error", 0.02, "--unseen", 0.02], quietly=arguments.json)
    arguments.demo, arguments.robot, arguments.loaded, arguments.empty = False, ARM_FILE, LOADED, [EMPTY]
    arguments.object, arguments.object_name = STOCK, PIECE
    arguments.size_error = arguments.unseen = 0.02
    status = run(arguments)
    if not arguments.json:
        print(f"\nIn the simulation the {PIECE} weighs {MASS:.3f} kg.")
    return status


def _recall(place: str | None, prior: Prior) -> Memory:
    """Recalls a memory; one that does not exist yet knows nothing."""
    if place is None:
        return MaterialMemory()
    from affordance.memory.ledger import has_memory, open_memory  # here, as SQLAlchemy takes a third of a second

    if not has_memory(place):
        return MaterialMemory()
    with open_memory(place) as ledger:
        return ledger.recall(prior=prior)


def _teach(
    arguments: argparse.Namespace,
    belief: PayloadBelief,
    seen: SeenObject,
    robot: SerialChain,
    run: Run,
    object_name: str,
    settings: IdentificationSettings,
    prior: Prior,
) -> tuple[PayloadBelief, str]:
    """Appends what the run teaches; returns the belief, with the memory after it, and a sentence about that."""
    place = arguments.learned or arguments.memory
    if belief.seen is None or not (belief.teaches or arguments.anyway):
        reason = "the object is not what it looks like" if belief.is_trusted else "the result is not to be trusted"
        return belief, f"{place} learns nothing: {reason} (--anyway teaches it)"
    from affordance.memory.ledger import has_memory, open_memory

    trial = build_identified_trial(belief, seen, robot, run, object_name, settings.unseen_share)
    with open_memory(place) as ledger:
        if arguments.learned and arguments.memory and has_memory(arguments.memory):
            with open_memory(arguments.memory) as before:
                ledger.merge(before)
        is_new = ledger.append([trial])
        changed = ledger.count_of_other_arms(trial.robot, trial.fingerprint, *_recognise(Path(robot.source)))
        memory = ledger.recall(prior=prior)
    belief = replace(belief, seen=replace(belief.seen, memory=memory))
    lesson = f"{place} {'has learned them' if is_new else 'learns nothing: this run has taught it before'}"
    if changed:
        lesson += (
            f"; the arm of {trial.robot} was another in {changed} earlier trials, which still count for materials"
        )
    return belief, lesson


def _recognise(source: Path) -> list[str]:
    """Lists the fingerprint that simulated trials of an arm in directives have."""
    from affordance.simulation.trial_record import recognise_arm  # here, as a run that teaches nothing need not wait

    return [recognise_arm(source)] if source.name == ARM_FILE.name else []


def _place_object(run: Run, values: Sequence[float]) -> Run:
    """Returns the run with the pose of the seen object in the tip: position, [m], roll, pitch and yaw, [deg]."""
    for name, value in zip(("X", "Y", "Z", "ROLL", "PITCH", "YAW"), values, strict=True):
        bound = 2.0 if len(name) == 1 else 360.0
        check_number(f"--object-pose {name}", value, -bound, bound)
    pose = np.eye(4)
    pose[:3, :3] = scipy.spatial.transform.Rotation.from_euler("xyz", values[3:], degrees=True).as_matrix()
    pose[:3, 3] = values[:3]
    return replace(run, description=replace(run.description, object_pose=pose))


def _build_settings(arguments: argparse.Namespace) -> IdentificationSettings:
    check_bounds(arguments)
    check_whole("--samples", arguments.samples, NUM_SAMPLES)
    check_number("--unseen", arguments.unseen, 0.0, 1.0)
    settings = IdentificationSettings(
        num_samples=arguments.samples, seed=arguments.seed, unseen_share=arguments.unseen
    )
    if arguments.min_speed is not None:
        check_number("--min-speed", arguments.min_speed, MIN_SPEED.low, MIN_SPEED.high, "rad/s")
        settings = replace(settings, min_speed=arguments.min_speed)
    off = {name.replace("-", "_"): False for name in arguments.off}
    return replace(settings, **off)  # type: ignore[arg-type]


def _load_robot(arguments: argparse.Namespace, loaded: Run) -> SerialChain:
    given = [each for each in (arguments.robot, arguments.robot_option) if each is not None]
    if len(given) != 1:
        raise BadValueError(
            "--robot", "", f"is given {len(given)} times, must be given once, as an option or without"
        )
    (robot,) = given
    tip = arguments.tip or loaded.description.tip or (HAND_FRAME if robot.is_dir() else "")
    if not tip:
        raise BadValueError("--tip", "", "is missing, and the run's description names no tip either")
    return load_robot(robot, tip, arguments.base or loaded.description.base or None)


def _find_tool(arguments: argparse.Namespace) -> Tool:
    """Finds the object that a camera saw."""
    check_number("--size-error", arguments.size_error, 0.0, 1.0)
    tools = load_tools(arguments.object, load_materials(arguments.materials))
    named = {tool.name: tool for tool in tools}
    name = arguments.object_name or tools[0].name
    if name not in named:
        raise BadValueError("--object-name", "", f"is {name!r}, must be one of {', '.join(named)}")
    return named[name]


def _write(folder: Path, belief: PayloadBelief, content: dict[str, object], text: str, is_used: bool) -> None:
    # Imported here: they take most of a second, which runs without --out need not wait.
    from affordance.files.netcdf import LabelledArray, Trajectories, write_trajectories
    from affordance.reporting.figures import save_figure
    from affordance.reporting.payload_figures import draw_fit, draw_posteriors, draw_whiteness

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
