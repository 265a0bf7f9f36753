"""Study on real recordings: numbers, figures, and a section of the report."""

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib.figure import Figure

from affordance.identification.evidence.gains import build_nominal_gains
from affordance.identification.evidence.unpaired_runs import fit_empty_arm
from affordance.identification.recording.preparation import prepare
from affordance.identification.settings import IdentificationSettings, SignalKind
from affordance.reporting.payload_figures import draw_fit, draw_posteriors, draw_whiteness
from affordance.reporting.section import render_section
from affordance.runs.repeats import list_versions
from studies.recorded.clones import (
    UR10E_LOAD,
    WeighedObject,
    load_panda,
    load_ur10e,
    load_weighed_objects,
)
from studies.recorded.figures import Weighing, draw_injections, draw_masses, draw_peers
from studies.recorded.panda import study_panda
from studies.recorded.peers import TO_90
from studies.recorded.simulated_truths import measure_coverage
from studies.recorded.timing import measure_times
from studies.recorded.ur10e import Ur10eResult, study_ur10e
from studies.recorded.weighed_objects import SERVO_PRIOR, WeighedResult, study_weighed_objects
from studies.study import Findings, write_findings

NAME = "recorded"
SECTION = Path(__file__).with_name("section.yaml")


class StudyConfig(NamedTuple):
    """Size of the study.

    Attributes:
        injections: Number of payloads injected into the Panda's noise, for each length of window.
        draws: Number of bodies drawn from the prior, and of seen objects with a hidden part.
        seed: Root of every random draw.
    """

    injections: int = 200
    draws: int = 500
    seed: int = 0


def run_study(data: Path, folder: Path, config: StudyConfig) -> Path:
    """Runs the study on clones of the repositories.

    Args:
        data: Folder that holds the clones under the names of their repositories.
        folder: Folder for metrics.json (the numbers), details.json, figures and the section of the report.
        config: Size of the study.

    Returns: Path of the report.

    Raises:
        BadValueError: A recording is missing; nothing was written.
    """
    start = time.perf_counter()
    settings = IdentificationSettings(seed=config.seed)
    # All are read before anything is run, so that a missing clone is reported at once.
    pair, panda, objects = load_ur10e(data), load_panda(data), load_weighed_objects(data)
    ur10e = study_ur10e(pair, settings)
    servos = replace(settings, signal_prior=SERVO_PRIOR)
    weighed = study_weighed_objects(objects, servos)
    injected = study_panda(panda, settings, num_injections=config.injections, seed=config.seed)
    prepared = prepare(panda.empty, settings)
    nominal = build_nominal_gains(panda.robot.joint_names, SignalKind.JOINT_TORQUE, settings)
    noise = fit_empty_arm(panda.robot, [prepared], [prepared.signal], nominal, settings).least_variance
    few = replace(settings, num_samples=1000)
    coverage = measure_coverage(panda.robot, prepared, noise, few, num_draws=config.draws, seed=config.seed)
    times = measure_times(data, ur10e.evidence, ur10e.gains, settings)
    numbers = {
        "ur10e": ur10e.numbers,
        "panda": injected.numbers,
        "lbipe": weighed.numbers,
        **coverage,
        **times,
    }
    details = {
        "ur10e": ur10e.details,
        "panda": injected.details,
        "lbipe": weighed.details,
        "config": config,
        "versions": list_versions(),
        "wall_s": time.perf_counter() - start,
    }
    figures: dict[str, Callable[[], Figure]] = {
        "masses": lambda: draw_masses(*list_weighings(ur10e, weighed, objects)),
        "injections": lambda: draw_injections(injected),
        "peers": lambda: draw_peers(times["peers"]),
        "fit": lambda: draw_fit(ur10e.belief.fit),
        "whiteness": lambda: draw_whiteness(ur10e.belief.fit),
        "posteriors": lambda: draw_posteriors(ur10e.belief),
    }
    section = render_section(SECTION, flatten(numbers), {"details": details, "config": config})
    return write_findings(Findings(numbers, figures=figures, details=details), folder, section)


def list_weighings(
    ur10e: Ur10eResult, weighed: WeighedResult, objects: Mapping[str, WeighedObject]
) -> tuple[list[Weighing], Weighing, list[Weighing]]:
    """Lists the masses to draw: of the UR10e's load, of its empty hand, of the servo arm's objects."""
    halves, numbers, details = ur10e.halves, ur10e.numbers, ur10e.details

    def weigh(name: str, mean: float, sd: float, truth: float) -> Weighing:
        return Weighing(name, mean, mean - TO_90 * sd, mean + TO_90 * sd, truth)

    pair = [
        weigh("first half", halves.mass[0], halves.sd[0], UR10E_LOAD),
        weigh("second half", halves.mass[1], halves.sd[1], UR10E_LOAD),
        weigh("unpaired", details["unpaired_mass_kg"], details["unpaired_mass_sd_kg"], UR10E_LOAD),
    ]
    empty = weigh("empty hand", numbers["empty_as_load_kg"], numbers["empty_as_load_sd_kg"], 0.0)
    servo = [
        Weighing(name, belief.mass, *belief.mass_interval90, objects[name].mass)
        for name, belief in weighed.beliefs.items()
    ]
    return pair, empty, servo


def flatten(numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers by one name each, as claims name them: ur10e.half_error is ur10e_half_error."""
    flat: dict[str, Any] = {}
    for name, value in numbers.items():
        if isinstance(value, Mapping):
            flat |= {f"{name}_{key}": entry for key, entry in flatten(value).items()}
        else:
            flat[name] = value
    return flat
