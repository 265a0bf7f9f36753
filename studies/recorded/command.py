"""``affordance study recorded``: identifies payloads in real recordings published by others."""

import argparse
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

from affordance.arguments import REPEATS, check_whole
from affordance.commands.options import add_out, add_repeats, add_seed
from affordance.identification.evidence.gains import build_nominal_gains
from affordance.identification.evidence.unpaired_runs import fit_empty_arm
from affordance.identification.recording.preparation import prepare
from affordance.identification.settings import IdentificationSettings, SignalKind
from affordance.reporting.payload_figures import draw_fit, draw_posteriors, draw_whiteness
from studies.recorded.clones import (
    UR10E_LOAD,
    PandaData,
    Ur10eData,
    WeighedObject,
    load_panda,
    load_ur10e,
    load_weighed_objects,
)
from studies.recorded.figures import Weighing, draw_injections, draw_masses, draw_peers
from studies.recorded.panda import study_panda
from studies.recorded.peers import TO_90
from studies.recorded.report import describe
from studies.recorded.seen_sizes import measure_seen_sizes
from studies.recorded.simulated_truths import World, measure_class_coverage, measure_coverage
from studies.recorded.timing import measure_times
from studies.recorded.ur10e import Ur10eResult, study_ur10e
from studies.recorded.verdicts import measure_false_alarms, measure_seed_shift, study_mistakes
from studies.recorded.weighed_objects import SERVO_PRIOR, WeighedResult, study_weighed_objects
from studies.study import Findings, Study, Work


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument(
        "--data", type=Path, required=True, help="folder with the clones, named like the repositories"
    )
    add_out(parser)
    add_repeats(parser, 500, "simulated truths of each kind", former=["--draws"])
    parser.add_argument(
        "--injections", type=int, default=200, help="number of payloads for each length of window (default 200)"
    )
    add_seed(parser)


def plan(arguments: argparse.Namespace) -> Work:
    """Reads all recordings first, so that a missing clone is reported at once."""
    check_whole("--injections", arguments.injections, REPEATS)
    data = arguments.data
    return partial(_work, arguments, load_ur10e(data), load_panda(data), load_weighed_objects(data))


def _work(
    arguments: argparse.Namespace,
    pair: Ur10eData,
    panda: PandaData,
    objects: dict[str, WeighedObject],
    folder: Path,
) -> Iterator[Findings]:
    start, seed = time.perf_counter(), arguments.seed
    settings = IdentificationSettings(seed=seed)
    ur10e = study_ur10e(pair, settings)
    weighed = study_weighed_objects(objects, replace(settings, signal_prior=SERVO_PRIOR))
    injected = study_panda(panda, settings, num_injections=arguments.injections, seed=seed)
    prepared = prepare(panda.empty, settings)
    nominal = build_nominal_gains(panda.robot.joint_names, SignalKind.JOINT_TORQUE, settings)
    noise = fit_empty_arm(panda.robot, [prepared], [prepared.signal], nominal, settings).least_variance
    world = World(panda.robot, prepared, noise, replace(settings, num_samples=1000))
    coverage = measure_coverage(world, num_draws=arguments.repeats, seed=seed)
    many = replace(world, settings=replace(settings, num_samples=4000))
    classes = measure_class_coverage(many, num_draws=arguments.repeats // 2, seed=seed)
    sizes = measure_seen_sizes(world, num_draws=arguments.repeats // 2, seed=seed)
    known = ur10e.gains.with_drift(settings)
    mistakes, tried = study_mistakes(pair, known, settings)
    alarms, num_windows = measure_false_alarms(pair, known, panda, settings)
    accepted, found = injected.injections[5].claims.mean(axis=0)
    times = measure_times(arguments.data, ur10e.evidence, ur10e.gains, settings)
    numbers = {
        "ur10e": ur10e.numbers,
        "panda": injected.numbers,
        "lbipe": weighed.numbers,
        **coverage,
        **classes,
        "size_seen_wrongly": sizes,
        "mistakes": mistakes,
        "false_alarms": alarms,
        "seed_shift_over_sd": measure_seed_shift(pair, known, panda, settings),
        "claimed": {"right_accepted": accepted, "wrong_found": found},
        **times,
    }
    config = {"injections": arguments.injections, "draws": arguments.repeats, "seed": seed}
    details = {
        "ur10e": ur10e.details,
        "panda": injected.details,
        "lbipe": weighed.details,
        "mistakes": tried,
        "good_windows": num_windows,
        "config": config,
        "wall_s": time.perf_counter() - start,
    }
    figures = {
        "masses": partial(draw_masses, *list_weighings(ur10e, weighed, objects)),
        "injections": partial(draw_injections, injected),
        "peers": partial(draw_peers, times["peers"]),
        "fit": partial(draw_fit, ur10e.belief.fit),
        "whiteness": partial(draw_whiteness, ur10e.belief.fit),
        "posteriors": partial(draw_posteriors, ur10e.belief),
    }
    yield Findings(numbers, describe(numbers, details), figures, details)


def list_weighings(
    ur10e: Ur10eResult, weighed: WeighedResult, objects: Mapping[str, WeighedObject]
) -> tuple[list[Weighing], Weighing, list[Weighing]]:
    """Lists the masses to plot: of the UR10e's load, its empty hand, and the servo arm's objects."""
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


STUDY = Study("identify what real robots held, from recordings in clones of public repositories", add_arguments, plan)
