"""Small runs of the studies, as shipped and with one thing changed, by whose numbers claims are judged.

Robots, recordings and tools that others published are not in the repository; in their place stand generated ones.
"""

import dataclasses
import functools
import re
import shutil
import tempfile
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from affordance.arrays import Array
from affordance.choice import blow_cost
from affordance.choice.hammer import load_hammer
from affordance.experiments.observers import Setup
from affordance.experiments.suite import find_experiment
from affordance.files.atomic import write_json
from affordance.files.model_folder import MODELS
from affordance.identification import identify as identify_module
from affordance.identification import systems
from affordance.identification.evidence.paired_runs import pair_runs
from affordance.identification.posterior.calibration import calibrate_gains
from affordance.identification.recording.preparation import prepare
from affordance.identification.settings import IdentificationSettings, SignalKind
from affordance.named_settings import NO_CHANGES, Changes, change_settings
from affordance.objects.tool import Grip, Tool
from affordance.proprioception.faults import Faults
from affordance.robots.importer import ImportOptions
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.pixels.camera_sensor import get_turning_stand
from helpers.generated_records import record_tool
from helpers.generated_runs import PAYLOAD, Truth, build_robot, generate_run
from helpers.robot_files import write_urdf
from helpers.study_runs import Numbers
from helpers.workshop import BLANKS, HAMMERS, MATERIALS
from studies.arms import measure, parity, robot_study
from studies.arms import report as arms
from studies.recorded import seen_sizes, simulated_truths, timing, ur10e, verdicts
from studies.recorded.clones import UR10E_LOAD, PandaData, Ur10eData, load_weighed_objects
from studies.recorded.mistakes import MISTAKES
from studies.recorded.panda import study_panda
from studies.recorded.simulated_truths import measure_class_coverage, measure_coverage
from studies.recorded.weighed_objects import SERVO_PRIOR, study_weighed_objects
from studies.robustness import study as robustness
from studies.tools import holds as tool_holds
from studies.tools import observer, records, study
from studies.tools import report as tools_report
from studies.tools.blows import check_blows
from studies.tools.data_set import Half, TrueInertia, compare_inertia, compute_central_inertia
from studies.tools.observer import ToolsConfig, run_observer
from studies.tools.record_methods import NOISES, PointParts
from studies.tools.seen import Source, examine, measure_drawing, paint
from studies.tools.study import Choices, ToolsResult, Uncommon

_DATA = Path(__file__).parents[1] / "data"
_IDENTIFICATION = IdentificationSettings(num_samples=300)
# Force of a tap that moves the nail by some millimetres, [N].
_TAP = 200.0


def evaluate_settings(count: int, error: float = 0.0) -> Numbers:
    """The study of robustness with a number of settings, in none of which an experiment can be run.

    Motions that are off by the largest error of interpolated ones, [m], are simulated in
    ``robustness/test_study.py::test_motions_that_are_wrong_are_found``.
    """
    study_of_few = robustness.load()
    with pytest.MonkeyPatch.context() as patch:
        nothing = robustness.Outcome(
            {},
            dict.fromkeys(robustness.list_claims(), float("nan")),
            dict.fromkeys((*robustness.EXPERIMENTS, robustness.TASKS), "no plan"),
            dict.fromkeys(robustness.PARTS, 0.0),
            {},
            error,
        )
        patch.setattr(robustness, "evaluate_setting", lambda setting, **more: nothing)
        one = study_of_few.run_setting(0)
    arrays = {name: np.stack([value] * (1 + count)) for name, value in one.items()}  # that of the simulations too
    return study_of_few.compute_metrics(arrays)


def import_arms(*, is_weak: bool = False, heavier: float = 1.0, changes: Changes = NO_CHANGES) -> Numbers:
    """An arm with the four simulations, which are loaded and not run, and a hold whose speed is measured.

    Weak joints have a hundredth of their torque limits; a link may be heavier than in the file that Pinocchio reads.
    """
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setattr(robot_study, "run_suite", _load_suite)
        patch.setattr(measure, "_TIMES", 2)
        patch.setattr(measure, "_HOLD", 0.15)
        models = _weaken(Path(folder)) if is_weak else MODELS
        config = robot_study.RunConfig(repeats=2)
        ran = {
            name: robot_study.run_program(name, models, Path(folder) / "results", config)
            for name in robot_study.EXPERIMENTS
        }
        metrics = {
            "loads": True,
            "experiments": {
                name: robot_study.OK if isinstance(found, dict) else found for name, found in ran.items()
            },
            "parity_error": _compare_with_pinocchio(Path(folder), patch, heavier),
            "real_time_factor": measure.measure_sag(MODELS, changes=changes).real_time_factor,
        }
    return arms.count({"ours": {"required": True, "metrics": metrics}})


def _load_suite(names: list[str], setup: Setup) -> None:
    for name in names:
        find_experiment(name).read(setup)
        write_json(setup.out / name / "metrics.json", {})
        write_json(setup.out / name / "section.json", {"claims": []})


def _weaken(folder: Path) -> Path:
    models = folder / "weak"
    shutil.copytree(MODELS, models)
    text = (models / "arm.sdf").read_text(encoding="utf-8")
    weak = re.sub(r"<effort>([\d.]+)<", lambda found: f"<effort>{0.01 * float(found[1]):g}<", text)
    assert weak != text
    (models / "arm.sdf").write_text(weak, encoding="utf-8")
    return models


def _compare_with_pinocchio(folder: Path, patch: pytest.MonkeyPatch, heavier: float) -> float:
    """Largest difference between an arm and Pinocchio's, whose file may have a heavier link."""
    pytest.importorskip("pinocchio")
    grey = '<material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>'  # Pinocchio accepts it only once
    path = write_urdf(folder, changes={grey: ""})
    other = path.with_name("other.urdf")
    text = path.read_text(encoding="utf-8")
    mass = text.split('<mass value="')[1].split('"')[0]
    other.write_text(
        text.replace(f'<mass value="{mass}"', f'<mass value="{heavier * float(mass)}"'), encoding="utf-8"
    )
    build = parity._build_reduced
    patch.setattr(parity, "_build_reduced", lambda path, imported: build(other, imported))
    return parity.compute_parity(path, ImportOptions("right_tool"), 0).largest


@functools.cache
def _build_robot() -> Any:
    return build_robot(Path(tempfile.mkdtemp()))


_TWO_MISTAKES = tuple(each for each in MISTAKES if each.name == "weighed in pounds" or ".55 as long" in each.name)
# A load as heavy as that of the UR10e.
_LOAD = PAYLOAD * UR10E_LOAD / PAYLOAD[0]


def _generate_pair(
    truth: Truth, rng: np.random.Generator, duration: float, empty: Array | None = None, loaded: Array = _LOAD
) -> Ur10eData:
    """Generates currents of the empty hand, or with something left in it, and with a load."""
    robot, options = _build_robot(), {"kind": SignalKind.CURRENT, "duration": duration, "rate": 40.0}
    runs = [generate_run(robot, load, truth=truth, rng=rng, **options) for load in (empty, loaded)]
    return Ur10eData(robot, *runs)


def identify_current(*, is_wrong: bool = False) -> Numbers:
    """The study of the UR10e on generated currents.

    If wrong, joints lose nothing to friction, gains rise by a tenth half-way, and something is left in the hand that
    counts as empty.
    """
    truth = Truth(
        gain=0.1, load_friction=0.0 if is_wrong else 0.1, friction=(2.0, 1.0, 0.5), noise_sd=0.05, agreement=0.3
    )
    left = {"empty": 0.1 * _LOAD, "loaded": 1.1 * _LOAD} if is_wrong else {}
    pair = _generate_pair(truth, np.random.default_rng(4), 24.0, **left)
    if is_wrong:
        count = len(pair.loaded.times)
        factor = np.where(np.arange(count) < count // 2, 1.0, 1.1)[:, None]
        runs = (dataclasses.replace(run, signal=factor * run.signal) for run in (pair.empty, pair.loaded))
        pair = Ur10eData(pair.robot, *runs)
    with pytest.MonkeyPatch.context() as patch:
        # Beliefs and windows are details that no claim is about.
        patch.setattr(ur10e, "identify", Mock())
        patch.setattr(ur10e, "_measure_drift", Mock())
        return {"ur10e": ur10e.study_ur10e(pair, _IDENTIFICATION).numbers}


def inject(*, is_white: bool = False, believes_white: bool = False) -> Numbers:
    """The study of payloads put into generated torques, whose errors may be independent and large, or taken to be."""
    robot, rng = _build_robot(), np.random.default_rng(5)
    truth = Truth(
        friction=(0.2, 0.1, 0.1),
        noise_sd=9.0 if is_white else 0.2,
        agreement=0.0 if is_white else 0.5,
        file_error=0.0 if is_white else 0.05,
    )
    empty = generate_run(robot, None, truth=truth, rng=rng, duration=20.0, rate=40.0)
    believed = {"correlated_noise": False, "floor": False} if believes_white else {}
    settings = dataclasses.replace(_IDENTIFICATION, **believed)
    result = study_panda(PandaData(robot, empty), settings, num_injections=4 if is_white else 1, seed=0)
    claims = result.injections[5].claims.mean(axis=0)
    return {"panda": result.numbers, "claimed": dict(zip(("right_accepted", "wrong_found"), claims, strict=True))}


def weigh(*, scale: float = 1.0) -> Numbers:
    """The study of weighed objects on a servo arm, whose recordings are here, by a scale with an error."""
    settings = dataclasses.replace(_IDENTIFICATION, signal_prior=SERVO_PRIOR)
    objects = {name: each._replace(mass=scale * each.mass) for name, each in load_weighed_objects(_DATA).items()}
    return {"lbipe": study_weighed_objects(objects, settings).numbers}


def cover(*, overconfident: float = 1.0) -> Numbers:
    """Coverage of drawn truths with errors taken for smaller than they are, by a factor."""
    robot = _build_robot()
    run = generate_run(robot, None, truth=Truth(), rng=np.random.default_rng(6))
    likelihood = simulated_truths.PayloadLikelihood
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            simulated_truths,
            "PayloadLikelihood",
            lambda statistics, known, variance: likelihood(statistics, known, variance / overconfident**2),
        )
        world = simulated_truths.World(robot, prepare(run, _IDENTIFICATION), np.full(6, 0.2), _IDENTIFICATION)
        classes = measure_class_coverage(world, num_draws=3, seed=0)
        return {**measure_coverage(world, num_draws=6, seed=0), **classes}


def see_sizes(*, size_error: float = 0.2) -> Numbers:
    """Coverage of densities of objects whose sizes are seen wrongly but taken for nearly right."""
    robot = _build_robot()
    run = generate_run(robot, None, truth=Truth(), rng=np.random.default_rng(6))
    world = simulated_truths.World(robot, prepare(run, _IDENTIFICATION), np.full(6, 0.2), _IDENTIFICATION)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(seen_sizes, "_SIZE_ERROR", size_error)
        return {"size_seen_wrongly": seen_sizes.measure_seen_sizes(world, num_draws=8, seed=0)}


def judge_itself(
    *, is_blind: bool = False, noise_sd: float = 0.1, num_samples: int = 800, only: Collection[str] = ()
) -> Numbers:
    """Numbers, those named or all, by which identification judges itself on a generated pair with noise, [N m].

    If blind, no doubts are found; edges of intervals are found by a number of samples. Two mistakes are made, each
    with the load weighed and with gains: all four are doubted, and answered wrongly by a blind identification.
    """
    robot, rng = _build_robot(), np.random.default_rng(3)
    truth = Truth(gain=0.1, load_friction=0.05, friction=(1.0, 0.5, 0.2), noise_sd=noise_sd)
    pair = _generate_pair(truth, rng, 20.0)
    quiet = Truth(noise_sd=0.1)
    panda = PandaData(robot, generate_run(robot, _LOAD, truth=quiet, rng=rng, duration=20.0, rate=40.0))
    gains = calibrate_gains(pair_runs(*pair, _IDENTIFICATION), UR10E_LOAD, _IDENTIFICATION)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(verdicts, "MISTAKES", _TWO_MISTAKES)
        patch.setattr(verdicts, "_PAIR_LENGTHS", (16.0,))
        patch.setattr(verdicts, "_MODES", verdicts._MODES[1:2])
        patch.setattr(verdicts, "_SINGLE_LENGTHS", (15.0,))
        patch.setattr(verdicts, "_SEEDS", range(2))
        if is_blind:
            patch.setattr(identify_module, "find_doubts", lambda *arguments: ())
        settings = dataclasses.replace(_IDENTIFICATION, num_samples=num_samples)
        found = {
            "mistakes": lambda: verdicts.study_mistakes(pair, gains, settings)[0],
            "false_alarms": lambda: verdicts.measure_false_alarms(pair, gains, panda, settings)[0],
            "seed_shift_over_sd": lambda: verdicts.measure_seed_shift(pair, gains, panda, settings),
        }
        numbers = {name: find() for name, find in found.items() if name in (only or found)}
    if "mistakes" in numbers:  # as if all had been tried, so that only wrong answers contradict the claim
        numbers["mistakes"]["tried"] *= len(MISTAKES) // len(_TWO_MISTAKES)
    return numbers


def time_identification(*, num_samples: int = 300) -> Numbers:
    """Times of a sample, of a belief with a number of samples, and of a run."""
    pair = _generate_pair(Truth(gain=0.1), np.random.default_rng(7), 12.0)
    settings = dataclasses.replace(_IDENTIFICATION, num_samples=num_samples)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(timing, "load_ur10e", lambda data: pair)
        patch.setattr(timing, "compare_peers", lambda *arguments: {})
        patch.setattr(timing, "_REPEATS", 1)
        patch.setattr(timing, "_NUM_STEPS", 300)
        patch.setattr(systems, "_NUM_SAMPLES", num_samples)
        evidence = pair_runs(*pair, settings)
        gains = calibrate_gains(evidence, UR10E_LOAD, settings)
        return timing.measure_times(Path(), evidence, gains, settings)


def _list_numbers(config: ToolsConfig | None = None, blows: Sequence[Any] = (), **found: Any) -> Numbers:
    """Lists the numbers that claims of the study of tools are about, where nothing else was found."""
    own = Choices((), {}, [*blows])
    result = ToolsResult(config or ToolsConfig(), {"own": own}, Uncommon((), [], []), **found)
    return tools_report.measure(result)


class _Workshop:
    """Our own tools in the place of the data set: blanks and two hammers to learn from, one to predict."""

    def __init__(self, *arguments: Any) -> None:
        held = (Grip("whole", np.eye(4)),)
        blanks = {name: dataclasses.replace(tool, grips=held) for name, tool in BLANKS.items()}
        self.tools: dict[str, Tool] = {**blanks, **HAMMERS}
        self.materials = MATERIALS
        learning, tested = (*list(blanks)[:4], "mallet", "claw hammer"), ("machinist hammer",)
        self._names = {Half.LEARNING: learning, Half.TEST: tested}

    def list_names(self, half: Half) -> tuple[str, ...]:
        """Names of the tools of a half."""
        return self._names[half]

    def read_truth(self, name: str) -> TrueInertia:
        """True inertia of a tool."""
        tool = self.tools[name]
        return TrueInertia(tool.mass, tool.p_TTcm, compute_central_inertia(tool.parameters))


@functools.cache
def use_tools(*, is_numb: bool = False, seen_scale: float = 1.0) -> Numbers:
    """First touch of the workshop's tools, by drawings, and by drawings of another scale in place of pictures."""
    workshop = _Workshop()

    def measure_all(tool: Tool, stand: Any, rng: Any, sources: Any) -> dict[Source, Any]:
        drawn = measure_drawing(tool)
        seen = tuple(
            dataclasses.replace(part, shape=part.shape.with_sizes(seen_scale * part.shape.sizes)) for part in drawn
        )
        return {source: drawn if source is Source.CAD else seen for source in sources}

    settings = change_settings(DEFAULT_SETTINGS, {"noise.threshold": 50.0} if is_numb else {})
    config = ToolsConfig(Path(), sources=(Source.CAD, Source.TWO_VIEWS), settings=settings)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(observer, "get_turning_stand", lambda: None)
        patch.setattr(observer, "measure_all", measure_all)
        patch.setattr(tool_holds, "DURATION", 0.3)
        patch.setattr(tools_report, "LEARNING", workshop.list_names(Half.LEARNING))
        names = workshop.tools
        truths = {name: observer.read_truth_in_hand(workshop, name) for name in names}  # type: ignore[arg-type]
        found = run_observer(config, workshop, 0)  # type: ignore[arg-type]
        scores = {key: study._score([each], truths) for key, each in found.first_touch.items()}
        return _list_numbers(config, scores=scores, predictions=[found], truths=truths)


def compare_meshes(*, denser: float = 1.0, longer: float = 0.0) -> Numbers:
    """Comparison of tools with data that are denser by a factor and longer by a number of metres."""
    workshop = _Workshop()
    truths = {name: workshop.read_truth(name) for name in HAMMERS}
    found = {
        name: compare_inertia(
            HAMMERS[name],
            TrueInertia(denser * truth.mass, truth.p_FBcm + longer, denser * truth.I_BBcm_F),
        )
        for name, truth in truths.items()
    }
    return _list_numbers(parity=found)


def read_records(*, noise: float = 1.0, is_still: bool = False) -> Numbers:
    """Estimates by a generated record with a multiple of the highest noise, still as the authors' method assumes."""
    tool = HAMMERS["claw hammer"]
    recording = record_tool(tool.parameters, np.random.default_rng(0))
    if is_still:
        nothing = np.zeros_like(recording.a_WS)
        recording = recording._replace(a_WS=nothing, alpha_WS=nothing, w_WS=nothing)
    centres = np.array([part.X_TE[:3, 3] for part in tool.components])
    parts = PointParts(centres, np.array([part.shape.volume for part in tool.components]), np.arange(len(centres)))
    subject = records.Subject(recording, tool.parameters, np.full(3, 0.2), records._map_materials(tool), parts)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(records, "load_subject", lambda data, name: subject)
        high = type(NOISES["high"])(*(noise * np.array(NOISES["high"])))
        patch.setattr(records, "NOISES", {"high": high})
        found = records.compare_methods(None, "claw hammer")  # type: ignore[arg-type]
    methods = {
        name: dict(zip(("mass", "com", "inertia"), np.mean(errors, axis=0)[:3], strict=True))
        for name, errors in found["high"].items()
    }
    # The authors' method stands for what they stored.
    return {"records": {"high": {"ours": methods["ours"], "hps_stored": methods["hps"]}}}


@functools.cache
def strike_with_tools(*, aim: float = blow_cost.AIM, arm_mass_factor: float = 1.0) -> Numbers:
    """A tap with a hammer of the workshop, planned for a multiple of its force, by an arm that may be heavier."""
    settings = dataclasses.replace(DEFAULT_SETTINGS, faults=Faults(arm_mass_factor=arm_mass_factor))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(blow_cost, "AIM", aim)
        hammer = load_hammer(MODELS / "nail.yaml")
        nail = dataclasses.replace(hammer.nail, depth_demanded=_TAP / hammer.nail.stiffness)
        task = dataclasses.replace(hammer, nail=nail, force=_TAP)
        blows = check_blows([HAMMERS["mallet"]], ["handle"], task, settings)
    return _list_numbers(blows=blows)


def look(*, is_of_one_colour: bool = False) -> Numbers:
    """A hammer of the workshop in pictures, twenty times over; as it is, or in one paint."""
    tool = HAMMERS["mallet"]
    if is_of_one_colour:
        tool = paint(tool, [(0.5, 0.5, 0.5)] * len(tool.components))
    outcome = examine(tool, get_turning_stand(), MATERIALS, np.random.default_rng(0))
    made_out = {str(number): outcome for number in range(20)}
    return _list_numbers(made_out=made_out)
