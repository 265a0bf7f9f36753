"""``affordance identify``: identifies a robot's payload from recordings."""

import argparse
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from affordance.arguments import check_number, check_whole
from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.commands import answers, options
from affordance.commands.demo import ARM_FILE, MASS, PIECE, fill_in_recording
from affordance.commands.terminal import find_width
from affordance.exceptions import BadValueError
from affordance.extensions.memory.ledger import count_past_arms, describe_past_arms, has_memory, open_memory
from affordance.extensions.payload.evidence.gains import read_gains, write_gains
from affordance.extensions.payload.identified_trial import build_identified_trial, teach
from affordance.extensions.payload.identify import Runs, check_reference_mass, identify, see_tool
from affordance.extensions.payload.payload_claim import Claim, judge_claim
from affordance.extensions.payload.payload_file import check_target, describe_written, write_payload
from affordance.extensions.payload.payload_setting import format_payload, read_payload
from affordance.extensions.payload.payload_text import describe_payload, give_answer_line
from affordance.extensions.payload.posterior.part_posterior import SeenObject
from affordance.extensions.payload.posterior.payload_belief import PayloadBelief
from affordance.extensions.payload.recording.run import Run
from affordance.extensions.payload.recording.run_file import read_run
from affordance.extensions.payload.settings import CUTOFF, MIN_SPEED, NUM_SAMPLES, IdentificationSettings, SignalKind
from affordance.extensions.robots.recorded_arm import Flange, find_flange, find_imported_tip, load_robot
from affordance.files.atomic import write_atomic
from affordance.files.model_folder import MODELS
from affordance.objects.materials import MATERIALS, Material, load_materials
from affordance.objects.tool import Tool
from affordance.plant.arm import name_robot
from affordance.plant.load import HAND_FRAME
from affordance.plant.serial_chain import SerialChain


def run(arguments: argparse.Namespace) -> int:
    """Identifies the payload, prints and writes the result. Returns the exit status.

    The status is 0, or 3 if the result cannot be trusted or the recording does not show the mass.
    """
    if arguments.demo:
        return _run_demo(arguments)
    if arguments.loaded is None:
        raise BadValueError("--loaded", "", "is missing, must be a recording with the load; or give --demo")
    settings = _build_settings(arguments)
    prior = options.read_prior(arguments, "a seen object")
    loaded = read_run(arguments.loaded, arguments.description)
    empty = tuple(read_run(path, arguments.description) for path in arguments.empty)
    robot = load_robot_of(arguments, loaded)
    gains = None if arguments.gains is None else read_gains(arguments.gains)
    claimed = {str(path): read_payload(path) for path in arguments.claimed}
    flange = find_flange_of(arguments, robot, loaded)
    if claimed and isinstance(flange, str):
        raise BadValueError("--claimed", "", f"must be in the frame of the flange, but {flange}")
    for file, setting in claimed.items():
        if setting.frame and not isinstance(flange, str) and setting.frame != flange.name:
            problem = f"is {setting.frame!r}, must be that of the flange, {flange.name} (--flange names another)"
            raise BadValueError(file, "frame", problem)
    materials = load_materials(arguments.materials or _find_materials(robot))
    memory = _recall(arguments.memory, prior)
    if arguments.object is None and arguments.object_name is not None:
        raise BadValueError("--object-name", "", "describes a seen object, must be given with --object")
    tool = None if arguments.object is None else _load_tool(arguments, materials)
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
        deviation=prior.deviation,
        settings=settings,
    )
    if past := _find_past_arms(arguments, robot):
        belief = replace(belief, notes=(*belief.notes, past))
    lesson = ""
    if tool is not None and seen is not None and arguments.memory:
        belief, lesson = _teach(arguments, belief, seen, robot, loaded, tool.name, settings, prior)
    elif arguments.memory:
        lesson = f"{arguments.memory} learns nothing: no object seen by a camera was given (--object)"
    is_used = belief.is_trusted or arguments.anyway
    content = belief.to_dict()
    content["flange"] = None if isinstance(flange, str) else flange.name
    if is_used and belief.setting is not None and not isinstance(flange, str):
        content["payload_settings"] = format_payload(belief.setting.express(flange.X_FT), flange.name)
    claims: list[Claim] = []
    if not isinstance(flange, str):
        for file, setting in claimed.items():
            claims.append(Claim(file, setting, judge_claim(belief, setting, X_FT=flange.X_FT)))
        if claims:
            content["claims"] = [
                each.to_dict() | {"trusted": belief.is_trusted, "frame": flange.name} for each in claims
            ]
    colours = {each.name: each.colour for each in materials.values()} if seen else {}
    text = describe_payload(
        belief, claims, flange, materials=colours, taught=lesson, anyway=arguments.anyway, width=find_width()
    )
    content["answer"] = give_answer_line(belief, flange)
    if arguments.out is not None:
        write_belief(arguments.out, belief, is_used)
    if arguments.write is not None and is_used:
        note = f"not seen: {', '.join(sorted(belief.hidden))}" if belief.hidden else ""
        content["written"] = write_payload(
            arguments.write,
            belief.bodies.pi,
            belief.tip,
            weights=belief.bodies.weights,
            note=note,
            draws=arguments.draws,
            seed=arguments.seed,
        )
    answers.give_answer(arguments, "belief", text, content)
    if arguments.write is not None:
        answers.tell(arguments, describe_written(arguments.write, content.get("written", [])))
    return 0 if belief.is_trusted and belief.shows_mass else 3


def _run_demo(arguments: argparse.Namespace) -> int:
    """Identifies the payload in the package's recording."""
    fill_in_recording(arguments, flange=HAND_FRAME)
    status = run(arguments)
    if not arguments.json:
        answers.tell(arguments, f"\nThe true mass of the {PIECE} in the simulation is {MASS:.3f} kg.")
    return status


def write_belief(folder: Path, belief: PayloadBelief, is_used: bool) -> None:
    """Writes figures and samples. Calibrated gains are written only if the result is used and a load was weighed."""
    # Imported here: these imports take most of a second, and runs without --out do not need them.
    from affordance.extensions.payload.payload_figures import draw_fit, draw_posteriors
    from affordance.reporting.figures import save_figure

    save_figure(draw_fit(belief.fit), folder, "fit")
    save_figure(draw_posteriors(belief), folder, "posteriors")
    if belief.calibration is not None and is_used:
        write_gains(folder / "gains.yaml", belief.calibration)
    samples = {"parameters": belief.bodies.pi, "weight": belief.bodies.weights}
    write_atomic(folder / "samples.npz", lambda temporary: np.savez(temporary, allow_pickle=False, **samples))


def _recall(place: str | None, prior: Prior) -> MaterialMemory:
    """Loads the belief in a memory; empty if the memory does not exist yet."""
    if place is None or not has_memory(place):
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
    """Adds the run to the memory. Returns the belief with this memory, and a sentence about the update."""
    place = arguments.memory
    if belief.seen is None or not (belief.teaches or arguments.anyway):
        reason = "the object is not what it looks like" if belief.is_trusted else "the result is not to be trusted"
        return belief, f"{place} learns nothing: {reason} (--anyway teaches it)"
    trial = build_identified_trial(belief, seen, robot, run, object_name, settings.unseen_share)
    memory, is_new = teach(place, trial, prior)
    belief = replace(belief, seen=replace(belief.seen, memory=memory))
    learned = "has learned them" if is_new else "learns nothing: it already contains this run"
    return belief, f"{place} {learned}"


def _find_past_arms(arguments: argparse.Namespace, robot: SerialChain) -> str:
    """Describes how many trials in the memory are from another version of the arm; empty if there are none."""
    if not arguments.memory:
        return ""
    name = name_robot(Path(robot.source), robot.tip)
    return describe_past_arms(name, count_past_arms(arguments.memory, name, lambda: robot.fingerprint))


def _build_settings(arguments: argparse.Namespace) -> IdentificationSettings:
    options.check_bounds(arguments)
    check_target(arguments.write, arguments.draws)
    check_whole("--samples", arguments.samples, NUM_SAMPLES)
    check_number("--unseen", arguments.unseen, 0.0, 1.0)
    settings = IdentificationSettings(
        num_samples=arguments.samples, seed=arguments.seed, unseen_share=arguments.unseen
    )
    if arguments.min_speed is not None:
        check_number("--min-speed", arguments.min_speed, MIN_SPEED.low, MIN_SPEED.high, "rad/s")
        settings = replace(settings, min_speed=arguments.min_speed)
    if arguments.cutoff is not None:
        check_number("--cutoff", arguments.cutoff, CUTOFF.low, CUTOFF.high, "Hz")
        settings = replace(settings, cutoff=arguments.cutoff)
    return settings


def load_robot_of(arguments: argparse.Namespace, loaded: Run) -> SerialChain:
    """Loads the robot that the arguments name, up to its tip.

    The tip is named by the arguments, a run's description or the model folder.

    Raises:
        BadValueError: The robot is given twice or cannot be read, or its tip is not named.
    """
    given = [each for each in (arguments.robot, arguments.robot_option) if each is not None]
    if len(given) > 1:
        raise BadValueError(
            "--robot", "", f"is given {len(given)} times, must be given once: as an option or as an argument"
        )
    robot = given[0] if given else MODELS
    tip = arguments.tip or loaded.description.tip
    if not tip and robot.is_dir():
        of_file = find_imported_tip(robot)
        # Object poses are relative to the hand.
        tip = HAND_FRAME if arguments.object is not None else of_file or HAND_FRAME
        if tip == HAND_FRAME and of_file is not None and loaded.description.compensated_payload.any():
            problem = "is in the frame of the controller's tip, so --tip must name the tip of the robot's file"
            raise BadValueError(loaded.source, "compensated_payload", problem)
    if not tip:
        raise BadValueError("--tip", "", "is missing, must be given here or in the run's description, such as tool0")
    try:
        return load_robot(robot, tip, loaded.description.base or None)
    except BadValueError as error:
        option = str(error.source).removeprefix("--")
        if option == "base" or (option == "tip" and not arguments.tip and loaded.description.tip):
            raise BadValueError(loaded.source, f"{option} in its description", error.problem) from error
        raise


def find_flange_of(arguments: argparse.Namespace, robot: SerialChain, loaded: Run) -> Flange | str:
    """Finds the controller's frame for payloads. If there is none, returns the reason."""
    if loaded.description.kind is SignalKind.WRENCH and not arguments.flange:
        return f"a controller accepts no payload in the sensor frame {robot.tip} (name the flange: --flange NAME)"
    flange = find_flange(robot, arguments.flange or "", loaded.description.base or None)
    if flange is not None:
        return flange
    folder = Path(robot.source).parent
    if find_imported_tip(folder) is None:
        return f"controllers do not know {robot.tip}, our hand frame (name one that yours knows: --flange NAME)"
    return f"{folder} does not contain the name of the tip in the robot's file: import it again, or use --flange"


def _find_materials(robot: SerialChain) -> Path:
    """Finds the materials file of the robot's model folder, or of the package if that does not exist."""
    own = Path(robot.source).parent / MATERIALS.name
    return own if Path(robot.source).name == ARM_FILE.name and own.is_file() else MODELS / MATERIALS.name


def _load_tool(arguments: argparse.Namespace, materials: Mapping[str, Material]) -> Tool:
    """Loads the tool that describes a seen object."""
    check_number("--size-error", arguments.size_error, 0.0, 1.0)
    tools, _ = options.read_tools(arguments.object, materials)
    named = {tool.name: tool for tool in tools}
    name = arguments.object_name or tools[0].name
    if name not in named:
        raise BadValueError("--object-name", "", f"is {name!r}, must be one of {', '.join(named)}")
    return named[name]
