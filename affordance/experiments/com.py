"""Simulation II (paper, IV-B): the centre of mass of objects of equal weight.

Two objects of wood and steel, one the other turned around, are held again and again; what is learned of the materials
then serves to hold each of them once more, and a decoy that looks like the first and is made like the second.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.belief.memory import Memory
from affordance.exceptions import BadValueError
from affordance.experiments.shared.camera_views import add_camera_views
from affordance.experiments.shared.checks import (
    check_looks_differ,
    check_tools_are_honest,
    check_tools_can_be_held,
    check_tools_have_one_grip,
)
from affordance.experiments.shared.experience import Experience, ExperienceConfig, collect_experience
from affordance.experiments.shared.outputs import (
    RUN_SHOWN,
    describe_run,
    label_heights,
    label_motions,
    name_faults,
    stack_heights,
    warn_of_faults,
)
from affordance.experiments.vision_comparison import save_vision_metrics
from affordance.files.atomic import write_json
from affordance.files.model_folder import MODELS
from affordance.files.netcdf import Labelled, write_trajectories
from affordance.objects.load import load_materials, load_tools
from affordance.objects.tool import Tool, list_densities
from affordance.plant.arm import ARM
from affordance.random_streams import Stream
from affordance.reporting import figures
from affordance.reporting import statistics as metrics
from affordance.reporting.diagram_picture import save_diagram
from affordance.reporting.object_drawings import Drawing, draw_objects
from affordance.reporting.replay import Scene, write_replay
from affordance.reporting.report import Claim, Picture, Section, write_section
from affordance.reporting.wording import introduce_observers, show_beside, warn_of_few_observers
from affordance.runs.repeats import compute_key, run_repeats
from affordance.settings import Settings
from affordance.simulation.trial import SURPRISE, TrialRecord, get_runner
from affordance.vision.features import FeatureSource
from affordance.vision.observe import observe
from affordance.vision.visual_prior import predict_object

NAME = "com"
# Masses that differ by less than this fraction are equal: what is left is rounding.
_SAME_MASS = 1e-9
# Centres of mass closer than this are not different, [m].
_APART = 1e-3
# Stands for looking at an object without holding it, beside the draws of a trial, which count from 0.
_PREDICTED = 9


@dataclass(frozen=True)
class ComConfig:
    """What is run.

    Attributes:
        experience: The two honest objects, and how they are learned.
        decoy: Looks like the first and is made like the second.
    """

    experience: ExperienceConfig
    decoy: Tool

    @property
    def tools(self) -> tuple[Tool, ...]:
        """The objects of the test pass, the decoy last."""
        return (*self.experience.tools, self.decoy)


def load_objects(models: Path = MODELS) -> tuple[Tool, Tool, Tool]:
    """Reads the three objects from a folder of models.

    Raises:
        BadValueError: A file is wrong, or the objects do not make this experiment.
    """
    path = models / "tools" / "com.yaml"
    tools = load_tools(path, load_materials(models / "materials.yaml"))
    if len(tools) != 3:
        raise BadValueError(path, "tools", f"has {len(tools)} entries, must have 3: two objects and the decoy")
    first, second, decoy = tools
    check_tools_have_one_grip(path, tools)
    check_looks_differ(path, tools)
    check_tools_are_honest(path, (first, second))
    for tool in (second, decoy):
        if abs(tool.mass - first.mass) > _SAME_MASS * first.mass:
            problem = f"weighs {tool.mass:.9g} kg, must weigh the same as {first.name}, {first.mass:.9g} kg"
            raise BadValueError(path, f"tools: {tool.name}", problem)
    if decoy.appearance != first.appearance:
        raise BadValueError(path, f"tools: {decoy.name}", f"looks unlike {first.name}, must look the same")
    if not np.allclose(decoy.parameters, second.parameters, rtol=_SAME_MASS, atol=_SAME_MASS):
        raise BadValueError(path, f"tools: {decoy.name}", f"is made unlike {second.name}, must have the same inertia")
    if np.linalg.norm(first.p_TTcm - second.p_TTcm) < _APART:
        problem = f"has its centre of mass within {_APART:g} m of that of {first.name}, must have it elsewhere"
        raise BadValueError(path, f"tools: {second.name}", problem)
    return first, second, decoy


def load_config(
    models: Path = MODELS, seed: int = 0, feature_source: FeatureSource = FeatureSource.FEATURES
) -> ComConfig:
    """Reads arm and objects from a folder of models.

    Raises:
        BadValueError: A file is wrong, or the objects do not make this experiment.
        ModelFileError: The arm's file cannot be loaded or does not describe a fit arm.
    """
    *honest, decoy = load_objects(models)
    settings = Settings(arm=models / ARM.name, feature_source=feature_source)
    check_tools_can_be_held(models / "tools" / "com.yaml", (*honest, decoy), settings)
    return ComConfig(ExperienceConfig(tuple(honest), seed, settings), decoy)


def run_test_pass(config: ComConfig, memory: Memory, repeat: int) -> list[TrialRecord]:
    """Holds each object once with what is believed; nothing is learned from it."""
    held, runner = config.experience, get_runner(config.experience.settings)
    return [
        runner.run_hold(tool, memory, duration=held.duration, seed=(held.seed, repeat, Stream.TEST, trial))
        for trial, tool in enumerate(config.tools)
    ]


def run_repeat(config: ComConfig, experience: Experience, repeat: int) -> dict[str, NDArray[Any]]:
    """Runs an observer's test pass.

    Returns: Arrays over the three objects: ``times`` (N,), heights (3, N); ``parameters_predicted`` (3, 10), at the
        most probable densities; ``periods_limited``, ``periods_failed``, ``rejected`` and ``p_value`` (3,).
    """
    settings = config.experience.settings
    memory = experience.recall(repeat, experience.num_trials)
    records = run_test_pass(config, memory, repeat)
    parameters = []
    for trial, tool in enumerate(config.tools):
        rng = np.random.default_rng([config.experience.seed, repeat, Stream.TEST, trial, _PREDICTED])
        belief = predict_object(observe(tool, settings, rng), memory, settings.prior)
        parameters.append(belief.compute_parameters(belief.densities.compute_mode()))
    return {
        **stack_heights(records),
        "parameters_predicted": np.array(parameters),
        "periods_limited": np.array([record.counts.limited for record in records]),
        "periods_failed": np.array([record.counts.failed for record in records]),
        "rejected": np.array([record.samples.rejected for record in records]),
        "p_value": np.array([record.p_value for record in records]),
    }


def run(config: ComConfig, folder: Path, *, repeats: int, jobs: int) -> None:
    """Runs all observers and writes numbers, figures, trajectories, diagram, replay and section of the report.

    Args:
        config: What is run.
        folder: Receives the files; repeats that it holds already are not run again. Experience is kept beside it.
        repeats: Number of observers, at least 1.
        jobs: Number of processes, at least 1.
    """
    start = time.perf_counter()
    settings = config.experience.settings
    experience = collect_experience(config.experience, folder.parent / "experience", repeats=repeats, jobs=jobs)
    kept = folder / "repeats" / compute_key(config, settings.arm.parent)
    arrays = run_repeats(kept, partial(run_repeat, config, experience), repeats=repeats, jobs=jobs, description=NAME)
    shown = run_test_pass(config, experience.recall(RUN_SHOWN, experience.num_trials), RUN_SHOWN)
    numbers = compute_metrics(config, experience, arrays)
    warn_of_faults(NAME, numbers["samples_rejected_test"], numbers["trials_surprising_test"], repeats)
    _write_trajectories(folder / "trajectories.nc", config, arrays, shown)
    save_diagram(get_runner(settings).get_diagram(config.decoy).diagram, folder, "diagram")
    _draw(config, arrays, folder)
    section = name_faults(describe(config, numbers, repeats), settings.faults)
    write_section(folder, add_camera_views(section, folder, config.tools, settings, config.experience.seed))
    scenes = [
        Scene(tool, record.times, record.q, f"{tool.name}, {tool.mass:.2f} kg")
        for tool, record in zip(config.tools, shown, strict=True)
    ]
    title = f"Simulation II, seed {config.experience.seed}, after {experience.num_trials} trials"
    write_replay(folder / "replay.html", settings.arm, scenes, title=title)
    described = describe_run(config, seed=config.experience.seed, repeats=repeats, wall_s=time.perf_counter() - start)
    save_vision_metrics(folder, numbers, settings, seed=config.experience.seed, repeats=repeats)
    write_json(folder / "metrics.json", {**numbers, **described})  # last: where it is, the rest is too


def compute_metrics(config: ComConfig, experience: Experience, arrays: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    """Computes the numbers of the results contract from the arrays of all repeats."""
    excursion = metrics.compute_excursion(arrays["height_centre"])
    extreme = metrics.estimate_mean(excursion)
    deviation = metrics.estimate_mean(np.abs(excursion))
    true_mass = np.array([tool.mass for tool in config.tools])
    true_com = np.array([tool.p_TTcm for tool in config.tools])
    # Of the two honest objects; the decoy is meant to be misjudged.
    predicted = arrays["parameters_predicted"][:, :2]
    true = np.array([tool.parameters for tool in config.tools[:2]])
    mass_error = np.abs(predicted[..., 0] / true[:, 0] - 1.0)
    com_error = np.linalg.norm(predicted[..., 1:4] / predicted[..., :1] - true_com[:2], axis=-1)
    inertia_error = np.linalg.norm(predicted[..., 4:7] - true[:, 4:7], axis=-1) / np.linalg.norm(
        true[:, 4:7], axis=-1
    )
    memories = [experience.recall(repeat, experience.num_trials) for repeat in range(experience.num_repeats)]
    medians = np.median([memory.belief.compute_percentiles([0.5])[0] for memory in memories], axis=0)
    names = [part.material.name for tool in config.experience.tools for part in tool.components]
    names = list(dict.fromkeys(names))  # in the order of the looks
    densities = list_densities(config.experience.tools)
    return {
        "mass_true": true_mass,
        "p_ToTcm_x_true": true_com[:, 0],
        "height_extreme_m": extreme.mean,
        "height_extreme_m_ci95": extreme.ci95,
        "deviation_m": deviation.mean,
        "deviation_m_ci95": deviation.ci95,
        "density_median": dict(zip(names, medians, strict=True)),
        "density_true": {name: densities[observe] for name, observe in zip(names, experience.colours, strict=True)},
        "mass_error": np.median(mass_error),
        "com_error_m": np.median(com_error),
        "inertia_error": np.median(inertia_error),
        "height_extreme_grip_m": metrics.compute_excursion(arrays["height_grip"]).mean(axis=0),
        "height_extreme_com_m": metrics.compute_excursion(arrays["height_com"]).mean(axis=0),
        "periods_limited": arrays["periods_limited"].sum(axis=0),
        "periods_failed": arrays["periods_failed"].sum(axis=0),
        **experience.count_faults(),
        "samples_rejected_test": arrays["rejected"].sum(axis=0),
        "trials_surprising_test": (arrays["p_value"] < SURPRISE).sum(axis=0),
        "p_value_test": np.median(arrays["p_value"], axis=0),
    }


def describe(config: ComConfig, numbers: Mapping[str, Any], repeats: int) -> Section:
    """Puts the numbers beside what the paper says."""
    masses, places = numbers["mass_true"], 100.0 * np.asarray(numbers["p_ToTcm_x_true"])
    extreme, deviation = 100.0 * np.asarray(numbers["height_extreme_m"]), 100.0 * np.asarray(numbers["deviation_m"])
    low, high = 100.0 * np.asarray(numbers["height_extreme_m_ci95"])[2]
    grip, com = 100.0 * numbers["height_extreme_grip_m"][2], 100.0 * numbers["height_extreme_com_m"][2]
    mass_error, com_error = float(numbers["mass_error"]), 1000.0 * float(numbers["com_error_m"])
    inertia_error = float(numbers["inertia_error"])
    densities = ", ".join(
        f"{name} {value:.0f} (true {numbers['density_true'][name]:.0f})"
        for name, value in numbers["density_median"].items()
    )
    claims = [
        Claim(
            "IV-B, figure 5",
            "The three objects weigh the same, and have different centres of mass.",
            bool(np.ptp(masses) <= _SAME_MASS * masses[0] and abs(places[0] - places[1]) > 1.0),
            f"{masses[0]:.3f} kg each, equal to {np.ptp(masses) / masses[0]:.0e} of it; centres of mass at "
            + ", ".join(f"{place:.1f}" for place in places)
            + " cm from the grip",
        ),
        Claim(
            "IV-B",
            "Looks predict mass and centre of mass, once the materials are known (our bounds: a tenth, 1 cm).",
            bool(mass_error <= 0.1 and com_error <= 10.0),
            f"median error {show_beside(100 * mass_error, 10.0)} % of the mass, "
            f"{show_beside(com_error, 10.0)} mm in the centre of mass; densities in kg/m^3: {densities}",
        ),
        Claim(
            "IV-B",
            "The moment of inertia matrix can be estimated from the visual features (our bound: a tenth).",
            bool(inertia_error <= 0.1),
            f"median error {show_beside(100 * inertia_error, 10.0)} % of the moments of inertia about the grip",
        ),
        Claim(
            "figure 6",
            "The objects whose affordances are accurate stay near the height to hold.",
            bool(deviation[:2].max() < 0.5 * abs(extreme[2])),
            f"mean deviation {deviation[0]:.2f} and {deviation[1]:.2f} cm; the decoy's {deviation[2]:.2f} cm",
        ),
        Claim(
            "IV-B, figure 6",
            "An exaggerated lift of the decoy object is observed.",
            bool(low > 0.0 and extreme[2] >= 2.0 * deviation[:2].max()),
            f"mean excursion {extreme[2]:.2f} cm, 95 % interval {low:.2f} to {high:.2f}; "
            f"{extreme[2] / deviation[:2].max():.1f} times the larger mean deviation of the honest two",
        ),
    ]
    first, second, _ = (tool.name for tool in config.tools)
    return Section(
        order=2,
        title="Simulation II: the centre of mass",
        summary=(
            f"{introduce_observers(repeats, 'hold', 'holds')} {first} and {second} in turn, "
            f"{config.experience.num_trials} trials of {config.experience.duration:g} s, then each once more, "
            f"and the decoy, which looks like {first} and "
            f"is made like {second}; in this last pass nothing is learned."
            f"{warn_of_few_observers(repeats)}"
        ),
        pictures=[
            Picture(
                "figure5.png", "Figure 5. The objects, seen from the side; the cross is the true centre of mass."
            ),
            Picture(
                "figure6.png",
                "Figure 6. Heights of the objects' geometric centres. Right: points of the decoy. The arm braces for "
                f"a centre of mass {places[0]:.1f} cm from the grip and meets one at {places[2]:.1f} cm, so the "
                "wrist turns the object, and each of its points moves with its distance from the wrist: the grip by "
                f"{grip:.1f} cm, the centre of mass by {com:.1f} cm, the geometric centre by {extreme[2]:.1f} cm.",
            ),
        ],
        claims=claims,
        differences=[
            "The paper names wood and steel, but neither densities nor sizes; ours are in models/, with sources. "
            "What is compared is which object rises, not by how many centimetres."
        ],
    )


def _draw(config: ComConfig, arrays: Mapping[str, NDArray[Any]], folder: Path) -> None:
    first, second, decoy = config.tools
    drawings = [
        Drawing(first, f"1: {first.name}"),
        Drawing(second, f"2: {second.name}"),
        Drawing(decoy, f"3: {decoy.name}, as it looks"),
        Drawing(decoy, f"3: {decoy.name}, as it is made", as_made=True),
    ]
    figures.save_figure(draw_objects(drawings, columns=2), folder, "figure5")
    height = arrays["height_centre"]
    figure = figures.draw_heights_of_points(
        times=arrays["times"][0],
        shown=height[RUN_SHOWN],
        mean=metrics.estimate_mean(height),
        decoy={
            "geometric centre": metrics.estimate_mean(height[:, 2]),
            "grip": metrics.estimate_mean(arrays["height_grip"][:, 2]),
            "true centre of mass": metrics.estimate_mean(arrays["height_com"][:, 2]),
        },
        labels=[f"{k + 1}: {tool.name}" for k, tool in enumerate(config.tools)],
        shown_label=f"seed {config.experience.seed}, observer {RUN_SHOWN}",
        num_repeats=len(height),
    )
    figures.save_figure(figure, folder, "figure6")


def _write_trajectories(
    path: Path, config: ComConfig, arrays: Mapping[str, NDArray[Any]], shown: Sequence[TrialRecord]
) -> None:
    predicted = arrays["parameters_predicted"][..., 0]
    masses = Labelled(("repeat", "trial"), predicted, "kg", "mass predicted before the test pass")
    joint_names = get_runner(config.experience.settings).get_diagram(config.decoy).arm.joint_names
    write_trajectories(
        path,
        {**label_heights(arrays), "mass_predicted": masses, **label_motions(shown, f"observer {RUN_SHOWN}")},
        {"trial": [tool.name for tool in config.tools], "joint": joint_names},
    )
