"""Small runs of the study of active choice: few tasks, few observers; as shipped and with one thing changed."""

import functools
import itertools
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from affordance.choice import hold_worth
from affordance.choice.hold_samples import HoldSamples
from affordance.objects.load import load_tools
from affordance.objects.tool import Tool
from helpers.stacked import stack
from helpers.study_runs import Numbers
from studies.active import brute_force, repeats, stopping, study
from studies.active import world as worlds
from studies.active.kinds import compare_information

TASKS = ("reach",)
_RULES = ("value", "information", "random")
# Stock of which no tool is made: in the workshop, and in the paper's world.
_IRRELEVANT = ("rod of alloy_steel", "rod of ductile_iron", "rod of aluminium", "rod of brass", "block of brass")


@functools.cache
def choose_actively(*, is_perverse: bool = False) -> Numbers:
    """Returns the numbers of the study; if perverse, stock of materials of no tool is given the highest worth."""
    return study.describe_rules({rule: _live(rule, is_perverse and rule == "value") for rule in _RULES})


@functools.cache
def choose_in_paper_world(*, is_perverse: bool = False) -> Numbers:
    """Returns the numbers of the paper's world without hammering; if perverse, brass is held first."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(worlds, "_PAPERS_TASKS", TASKS)
        patch.setattr(worlds, "build_paper_world", functools.cache(worlds.build_paper_world.__wrapped__))
        names = [each.name for each in worlds.build_paper_world().questions]
        return study.describe_paper_world({"value": _live("value", is_perverse, ())}, names)


@functools.cache
def _live(rule: str, is_perverse: bool, tasks: tuple[str, ...] = TASKS) -> dict[str, Any]:
    with pytest.MonkeyPatch.context() as patch:
        if is_perverse:
            patch.setitem(
                study.RULES,  # type: ignore[arg-type]
                "value",
                lambda workshop, memory, left, rng: next((n for n in left if n in _IRRELEVANT), left[0]),
            )
        config = study.ActiveConfig(rule, tasks=tasks, horizon=4 if tasks else 3)
        return stack([study.run_observer(config, repeat) for repeat in range(2)])


@functools.cache
def compare_worths(*, is_linear: bool = False) -> Numbers:
    """Returns worths against brute force in two cases, hammering and uninformative stock; by a line if linear."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(worlds, "load_tools", _load_few)
        patch.setattr(worlds, "build_workshop", functools.cache(worlds.build_workshop.__wrapped__))
        patch.setattr(brute_force, "CASES", [brute_force.CASES[1], brute_force.CASES[3]])
        patch.setattr(brute_force, "_SEEDS", 4)
        if is_linear:
            patch.setattr(hold_worth, "_DEGREES", {0: 0, 1: 1, 2: 1})
        config = brute_force.WorthConfig(outcomes=20, draws=60)
        return brute_force.describe_worths(stack([brute_force.compare_worth(config, number) for number in (0, 1)]))


def _load_few(path: Path, materials: Any) -> tuple[Tool, ...]:
    """Loads the one tool that the cases are about, and all stock."""
    return tuple(tool for tool in load_tools(path, materials) if path.stem != "tools" or tool.name == "claw hammer")


@functools.cache
def stop(*, is_mixed_up: bool = False) -> Numbers:
    """Returns how observers stop; if mixed up, each piece of stock has the density of another material."""
    num_repeats = 12 if is_mixed_up else 3  # of few mixed up worlds most stop right by chance
    with pytest.MonkeyPatch.context() as patch:
        if is_mixed_up:
            patch.setattr(worlds, "draw_world", _mix_up)
        stops = {
            name: stopping.describe_stops(
                stack([stopping.run_observer(replace(config, tasks=TASKS), repeat) for repeat in range(num_repeats)])
            )
            for name, (config, _) in stopping.list_configs(0, num_repeats).items()
        }
    return stopping.summarise(stops)


_DRAW = worlds.draw_world


def _mix_up(workshop: worlds.Workshop, rng: np.random.Generator, means: Any = None) -> worlds.TrueWorld:
    true = _DRAW(workshop, rng, means)
    values = [density for each in true.densities.values() for density in each.values()]
    others = dict(zip(true.densities, reversed(values), strict=True))
    mixed = {name: dict.fromkeys(each, others[name]) for name, each in true.densities.items()}
    return true._replace(densities=mixed)


def repeat(*, is_anew: bool = False) -> Numbers:
    """Returns the calibration after ten holds; if anew, each hold counts a deviation of its own."""
    found = _hold_again()
    return repeats.describe_repeats(dict.fromkeys(found, found["repeat_z_anew"]) if is_anew else found)


@functools.cache
def _hold_again() -> dict[str, Any]:
    return stack([repeats.run_block(repeats.RepeatsConfig(2), 0)])


@functools.cache
def promise(*, forgets_kinds: bool = False) -> Numbers:
    """Returns promised and gained information; an odd object counts as one of its colour if kinds are forgotten."""
    with pytest.MonkeyPatch.context() as patch:
        if forgets_kinds:
            recognise = HoldSamples._recognise
            patch.setattr(
                HoldSamples, "_recognise", lambda self, parts: (_find_colours(self, parts), recognise(self, parts)[1])
            )
            patch.setattr(HoldSamples, "_is_odd", lambda self, name: False)
        return compare_information(holds=6)


def _find_colours(samples: Any, parts: Any) -> list[int]:
    return list(samples._memory.recall([part.appearance for part in parts], samples._prior).columns)


def time_advice(slower: float = 0.0) -> Numbers:
    """Returns the time of an advice, for one of three candidates, each slowed down by CPU time, [s].

    The CPU time is to be far above the scatter of a loaded machine.
    """
    workshop = study.worlds.build_workshop(TASKS)  # what is built once is not timed
    few = workshop._replace(candidates=dict(itertools.islice(workshop.candidates.items(), 3)))
    advise = study.worlds.advise

    def advise_slowly(workshop, memory, names, **options):
        end = time.process_time() + slower * len(names)
        while time.process_time() < end:
            pass
        return advise(workshop, memory, names, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study.worlds, "build_workshop", lambda tasks: few)
        patch.setattr(study.worlds, "advise", advise_slowly)
        patch.setattr(study, "_NUM_TIMED", 2)
        return {"ms_per_candidate": study.time_advice(TASKS)}
