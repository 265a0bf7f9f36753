"""Development in stages: Simulation I with three kinds of memory, with an adult's and an infant's arm.

Mounoud and Bower (1974, Cognition 3:29-40) gave rods to infants of several ages. Here each learner represents an age,
as a rung of a ladder, and makes a testable prediction about this age:

    nothing_remembered: every hold begins with the prior, and is then forgotten
    own_memory: the density of each object is remembered, from its second hold on
    density: one density per look is remembered, from all rods of that colour

The four rods of Simulation I are held from short to long, each twice in a row. Then follow two decoys, which are made
of beech but look like brass. One has the length of the longest rod, and one has a new length (22.5 cm). Each decoy is
held with the memory after the rods. The outcome measure is the largest excursion of the object's centre within one
second. In this time the arm of Simulation I reaches its lowest point, or comes within 0.1 mm of its highest point.

The infant's arm (models/infant.sdf) cannot hold rods of 15 cm or more at arm's length: regardless of the belief, they
load its wrist with up to 2.4 times its effort limit. Its rods are therefore scaled in length by the ratio of the two
reaches (0.44). Its smallest felt torque is scaled in the same way as its effort limits (by 0.125).

Predictions for means over observers, with either arm, were stated before the first run:

1. Nothing remembered: the arm sinks with every rod, farther with longer rods, and equally far in both holds of a rod.
   Both decoys rise, because beech is less dense than the mode of the prior, but by less than a quarter of their rise
   with rung 3.
2. Own memory: in the first hold of each rod, the arm sinks as in rung 1. In the second hold the excursion is less
   than half as large. The decoy that looks like the longest rod is mistaken for it, and rises at least half as far as
   with rung 3. The decoy of a new length rises less than a quarter as far as with rung 3.
3. Density by look: only the first hold of the first rod has a large error. The excursions in the first holds of all
   other rods are less than half as large. Both decoys rise.
4. The infant's arm gives the same results, but the ratio of second to first excursions is larger. Its rods are
   lighter relative to its smallest felt torque, so one hold is less informative.

Therefore a decoy that looks like a held rod cannot distinguish rung 2 from rung 3, but the first hold of a new rod
can.

    affordance run examples/experiments/ladder.py
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from affordance.arrays import Array, about
from affordance.belief.learner import Learner
from affordance.belief.learners import DENSITY
from affordance.experiments.shared.experiment import Experiment
from affordance.experiments.shared.holds import describe_holds, tabulate_holds
from affordance.experiments.shared.objects import check_can_be_held, check_no_grips, read_tools
from affordance.experiments.shared.observer_numbers import ObserverNumbers
from affordance.experiments.shared.observers import Setup, find_excursion, run_observers
from affordance.experiments.shared.results import Results
from affordance.extensions.people.rivals import NOTHING_REMEMBERED, OWN_MEMORY, label_learner
from affordance.objects.tool import Tool, list_colours
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.proprioception.torque_noise import WeberNoise, WhiteNoise
from affordance.reporting.claims import NONE, ClaimResult, Criterion, check, claim, with_interval
from affordance.reporting.figures import DECOY_COLOUR, FONT_SIZE, OBJECT_COLOURS, tidy
from affordance.reporting.formatting import count_observers
from affordance.simulation.trial import Observer, get_runner

OBJECTS = "tools/ladder.yaml"  # file in the model folder; the last two objects are the decoys
INFANT = "infant.dmd.yaml"  # file in the model folder
RUNGS = (NOTHING_REMEMBERED, OWN_MEMORY, DENSITY)
DURATION = 1.0  # duration of each hold, [s]
ARMS = ("adult", "infant")
# Behaviour of infants at the age that each learner represents. The source is Bower 1974, Development in Infancy, on
# motor behaviour. A translation was read for nine and twelve months; eighteen months is cited from memory and not
# checked. Mounoud and Bower's article was not read. In the paper (I, IV-A), the last rung is at nine months.
AGES = {
    "nothing_remembered": ("9 months", "the arm drops each time, even when the object was given several times"),
    "own_memory": ("12 months", "the drop is gone when the object is given again"),
    "density": ("18 months; the paper: 9 months", "a longer rod is expected to be heavier; a light one flies up"),
}
MEANINGS = {
    "first_m": "largest excursion in the first hold of each rod, m",
    "second_m": "largest excursion in its second hold, m",
    "decoy_m": "largest excursion of the decoy that looks like the longest rod, m",
    "new_decoy_m": "largest excursion of the decoy of a length never held, m",
}


def run(setup: Setup) -> Results:
    """Runs the experiment."""
    tools, data = read(setup), collect(setup)
    numbers = {"arms": {arm: summarise(data.sel(arm=arm)) for arm in ARMS}, **describe_arms(setup, tools)}
    learners = [str(each) for each in data.learner.values]
    return Results(
        title="Development as a ladder: three kinds of memory, and two arms",
        summary=(
            f"{count_observers(setup.observers)} of each learner held {len(tools['adult']) - 2} rods twice each, and"
            " two decoys: with an adult's arm, and scaled down with the arm of an infant of 9 to 11 months."
        ),
        finding="; ".join(_describe(numbers["arms"])) + ".",
        data=data,
        numbers=numbers,
        claims=judge(numbers["arms"]),
        figures={
            "ladder": (
                (
                    "Largest excursion of each object, down or up: mean with 95 % interval. Each column is a"
                    " learner, with the age that it stands for; each row is an arm. Rods are in the order in which"
                    " they were held, from short to long. Without memory, all observers do the same."
                ),
                partial(draw, numbers),
            )
        },
        tables={"What infants did, and what each learner does.": tabulate(numbers["arms"])},
        remarks=[
            (
                "Infants of 6 and 7 months do not even adapt to a weight while they hold it. The ladder has no rung"
                " for them: every learner here feels what it holds."
            ),
        ],
        lifts=pd.concat(
            [
                tabulate_lifts(data.sel(arm=arm, learner=learner), tools[arm], learner, arm)
                for arm in ARMS
                for learner in learners
            ]
        ),
        learners=learners,
    )


def predict(setup: Setup) -> ObserverNumbers:
    """Computes the results of each observer of every learner. The name of each result begins with the arm."""
    data = collect(setup)
    return ObserverNumbers(
        {
            str(learner): {
                f"{arm}_{name}": values
                for arm in ARMS
                for name, values in measure(data.sel(arm=arm, learner=learner)).items()
            }
            for learner in data.learner.values
        },
        {f"{arm}_{name}": f"{meaning}, {arm}'s arm" for arm in ARMS for name, meaning in MEANINGS.items()},
    )


def read(setup: Setup) -> dict[str, list[Tool]]:
    """Loads rods and decoys, scaled for the infant's arm, and checks that each arm can hold them."""
    file, infant = setup.models / OBJECTS, setup.models / INFANT
    tools = list(read_tools(setup.models, OBJECTS))
    check_no_grips(file, tools)
    size = find_reach(infant) / find_reach(setup.settings.arm)
    held = {"adult": tools, "infant": [tool.scaled(1.0, size) for tool in tools]}
    for arm, each in held.items():
        check_can_be_held(file, each, set_up_arm(setup, arm).settings)
    return held


def find_reach(arm: Path) -> float:
    """Computes the horizontal distance from base to hand in the holding posture, [m]."""
    loaded = load_arm(arm)
    model = ArmModel(loaded)
    model.set_posture(loaded.home)
    return float(np.hypot(*model.compute_hand_pose().translation()[:2]))


def compare_strength(setup: Setup) -> float:
    """Computes the median ratio of the infant's effort limits to the adult's."""
    infant, adult = (load_arm(each).limits.tau_max for each in (setup.models / INFANT, setup.settings.arm))
    return float(np.median(infant / adult))


def set_up_arm(setup: Setup, arm: str) -> Setup:
    """Returns the setup for an arm.

    The infant's smallest felt torque is scaled in the same way as its effort limits.
    """
    if arm == "adult":
        return setup
    ratio, noise = compare_strength(setup), setup.settings.noise
    if isinstance(noise, WeberNoise):
        noise = replace(noise, threshold=ratio * noise.threshold)
    elif isinstance(noise, WhiteNoise):
        noise = replace(noise, sd=ratio * noise.sd)
    return setup.change(arm=setup.models / INFANT, noise=noise)


def list_rungs(setup: Setup) -> list[Learner]:
    """Lists the learners of all rungs, and the learner in the settings if it is a different learner."""
    return [*{each.name: each for each in (*RUNGS, setup.settings.learner)}.values()]


def collect(setup: Setup) -> xr.Dataset:
    """Simulates the observers of each learner with each arm."""
    tools = read(setup)
    arms = []
    for arm in ARMS:
        parts = [
            run_observers("ladder", set_up_arm(setup, arm).change(learner=learner), observe, tools[arm])
            for learner in list_rungs(setup)
        ]
        names = xr.DataArray([each.name for each in list_rungs(setup)], dims="learner", name="learner")
        arms.append(xr.concat(parts, names, combine_attrs="override"))
    return xr.concat(arms, xr.DataArray([*ARMS], dims="arm", name="arm"), combine_attrs="override")


def observe(setup: Setup, tools: Sequence[Tool], observer: int) -> xr.Dataset:
    """Simulates one observer. Returns heights over time for all holds of rods and decoys."""
    *rods, decoy, new_decoy = tools
    memory = setup.start_memory(observer).add_colours(list_colours(tools), setup.settings.prior)
    hand = Observer(get_runner(setup.settings), memory, duration=DURATION)
    befores, records = [], []
    held = [rod for rod in rods for _ in range(2)]
    for trial, rod in enumerate(held):
        befores.append(hand.memory)
        records.append(hand.hold(rod, seed=(setup.seed, observer, trial)))
    learned = hand.memory
    for each in (decoy, new_decoy):  # each decoy is held with the memory after the rods
        hand = Observer(get_runner(setup.settings), learned, duration=DURATION)
        befores.append(hand.memory)
        records.append(hand.hold(each, seed=(setup.seed, observer, len(held))))
    held += [decoy, new_decoy]
    return xr.Dataset(
        {
            "height": (
                ("trial", "time"),
                [each.height_centre for each in records],
                about("m", "height of the object's geometric centre above where it was given"),
            ),
            **describe_holds(held, [*befores, learned], records, setup.settings),
        },
        {"time": ("time", records[0].times, about("s", "time since the object was given"))},
    )


def measure(data: xr.Dataset) -> dict[str, xr.DataArray]:
    """Computes the largest signed excursions, [m], for each observer of a learner."""
    excursion = find_excursion(data.height)
    rods = excursion.isel(trial=slice(-2))
    return {
        "first_m": rods.isel(trial=slice(0, None, 2)),
        "second_m": rods.isel(trial=slice(1, None, 2)),
        "decoy_m": excursion.isel(trial=-2),
        "new_decoy_m": excursion.isel(trial=-1),
    }


def summarise(data: xr.Dataset) -> dict[str, dict[str, Any]]:
    """Computes summaries over observers for each learner and arm, as in metrics.json."""
    summary = {}
    for learner in data.learner.values:
        found = measure(data.sel(learner=learner))
        summary[str(learner)] = {
            **{key: value for name, each in found.items() for key, value in with_interval(name, each).items()},
            "first_size_m": abs(found["first_m"]).mean("observer").values,
            "second_size_m": abs(found["second_m"]).mean("observer").values,
        }
    return summary


def describe_arms(setup: Setup, tools: Mapping[str, Sequence[Tool]]) -> dict[str, Any]:
    """Returns reach, strength and rod masses for each arm, as in metrics.json."""
    return {
        "reach_m": {arm: find_reach(set_up_arm(setup, arm).settings.arm) for arm in ARMS},
        "mass_true": {arm: [tool.mass for tool in tools[arm]] for arm in ARMS},
        "strength_ratio": compare_strength(setup),
    }


def judge(n: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> list[ClaimResult]:
    """Tests the predictions for each arm. Their bounds were stated before the first run."""

    def compare(text: str, value: Any, **bounds: float) -> list[Criterion]:
        return [check(f"{text}, {arm}'s arm", value(n[arm]), NONE, **bounds) for arm in ARMS]

    nothing, own, look = (each.name for each in RUNGS)
    return [
        claim("nothing_remembered", "ours, a prediction; Bower on 9 months",
              "Without memory the arm sinks with every rod, more with longer ones, and in both holds of a rod alike.",
              *compare("largest excursion, m", lambda a: a[nothing]["first_m"], below=0),
              *compare("change from rod to rod, m", lambda a: np.diff(a[nothing]["first_m"]), below=0),
              *compare("second hold divided by first", lambda a: a[nothing]["second_m"] / a[nothing]["first_m"],
                       at_least=0.99, at_most=1.01)),
        claim("own_memory", "ours, a prediction; Bower on 12 months",
              "With a memory of each object the arm sinks as far as without memory, but only in a rod's first hold.",
              *compare("first hold divided by first hold without memory",
                       lambda a: a[own]["first_m"] / a[nothing]["first_m"], at_least=0.99, at_most=1.01),
              *compare("size of the excursion, second hold divided by first",
                       lambda a: a[own]["second_size_m"] / a[own]["first_size_m"], below=0.5)),
        claim("look", "ours, a prediction; paper I and IV-A, Bower on 18 months",
              "With a density for each look the arm sinks with the first rod only.",
              *compare("first hold of the first rod, m", lambda a: a[look]["first_m"][0], below=0),
              *compare("size of the excursion, first holds of the other rods divided by that of the first",
                       lambda a: a[look]["first_size_m"][1:] / a[look]["first_size_m"][0], below=0.5)),
        claim("decoys", "ours, a prediction; paper IV-A",
              "Decoys of a new length rise only with densities by look; those like a known rod also with own memory.",
              *compare("lift of the decoys by look, m",
                       lambda a: np.array([a[look]["decoy_m"], a[look]["new_decoy_m"]]), above=0),
              *compare("lifts without memory divided by lifts by look",
                       lambda a: np.array([a[nothing][each] / a[look][each] for each in ("decoy_m", "new_decoy_m")]),
                       above=0, below=0.25),
              *compare("own memory, decoy like a known rod, divided by the lift by look",
                       lambda a: a[own]["decoy_m"] / a[look]["decoy_m"], at_least=0.5),
              *compare("own memory, decoy of a new length, divided by the lift by look",
                       lambda a: a[own]["new_decoy_m"] / a[look]["new_decoy_m"], below=0.25)),
        claim("infant", "ours, a prediction",
              "One hold is less informative with an infant's arm than with an adult's.",
              check("size of the excursion, second hold divided by first, own memory, infant's arm minus adult's",
                    np.subtract(*(np.mean(n[arm][own]["second_size_m"] / n[arm][own]["first_size_m"])
                                  for arm in ("infant", "adult"))), NONE, above=0)),
    ]  # fmt: skip


def _describe(n: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> list[str]:
    """Describes the first hold of the longest rod, which distinguishes memory of looks from memory of objects."""
    return [
        f"{label_learner(learner)}: the longest rod, held for the first time, moves by"
        f" {100.0 * found['first_m'][-1]:+z.1f} cm (adult's arm)"
        for learner, found in n["adult"].items()
    ]


def tabulate(n: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> pd.DataFrame:
    """Tabulates the behaviour of infants, and each learner's excursions with the adult's / the infant's arm, [cm]."""
    rows = {}
    for learner in n["adult"]:
        age, did = AGES.get(learner, ("", ""))
        row = {"infants": age, "what they did": did}
        for title, name, place in (
            ("first rod, first hold (cm)", "first_m", 0),
            ("first rod, second hold (cm)", "second_m", 0),
            ("longest rod, first hold (cm)", "first_m", -1),
            ("longest rod, second hold (cm)", "second_m", -1),
            ("decoy like the longest rod (cm)", "decoy_m", ...),
            ("decoy of a new length (cm)", "new_decoy_m", ...),
        ):
            values = [100.0 * float(np.asarray(n[arm][learner][name])[place]) for arm in ARMS]
            row[title] = " / ".join(f"{value:+z.1f}" for value in values)
        rows[label_learner(learner)] = row
    return pd.DataFrame.from_dict(rows, orient="index").rename_axis("learner")


def draw(n: Mapping[str, Any]) -> Figure:
    """Plots the excursions of each object, with a row for each arm and a column for each learner."""
    learners = [*n["arms"]["adult"]]
    figure = Figure(figsize=(4.0 * len(learners), 6.4))
    panels = figure.subplots(len(ARMS), len(learners), sharex=True, sharey="row", squeeze=False)
    for row, arm in zip(panels, ARMS, strict=True):
        for panel, learner in zip(row, learners, strict=True):
            _draw_excursions(panel, n["arms"][arm][learner])
        row[0].set_ylabel(f"{arm}'s arm, reach {100.0 * n['reach_m'][arm]:.0f} cm:\nexcursion (cm)")
    for panel, learner in zip(panels[0], learners, strict=True):
        age = f"\nstands for {AGES[learner][0]}" if learner in AGES else ""
        panel.set_title(f"{label_learner(learner)}{age}", fontsize=FONT_SIZE)
    panels[0][-1].legend(frameon=False, fontsize=FONT_SIZE - 1, loc="lower right")
    return figure


def _draw_excursions(panel: Axes, found: Mapping[str, Any]) -> None:
    rods = np.arange(len(found["first_m"]))
    names = [*(f"rod {1 + rod}" for rod in rods), f"decoy like rod {len(rods)}", "decoy, new length"]
    decoys = {end: np.array([found[f"{each}{end}"] for each in ("decoy_m", "new_decoy_m")]) for end in ("", "_ci95")}
    panel.axhline(0.0, color="0.6", linewidth=0.8)

    def mark(name: str, places: Any, mean: Array, ci95: Array, **style: Any) -> None:
        middle, error = 100.0 * mean, 100.0 * np.maximum(0.0, [mean - ci95[..., 0], ci95[..., 1] - mean])
        panel.errorbar(places, middle, error, capsize=2.0, label=name, **style)

    colour = OBJECT_COLOURS[0]
    mark("first hold", rods - 0.12, found["first_m"], found["first_m_ci95"], fmt="o", color=colour)
    mark(
        "second hold", rods + 0.12, found["second_m"], found["second_m_ci95"], fmt="o", color=colour, fillstyle="none"
    )
    mark("decoy, held once", len(rods) + np.arange(2.0), decoys[""], decoys["_ci95"], fmt="s", color=DECOY_COLOUR)
    panel.set_xticks(np.arange(len(names)), names, rotation=35, ha="right")
    tidy(panel)


def tabulate_lifts(data: xr.Dataset, tools: Sequence[Tool], learner: str, arm: str) -> pd.DataFrame:
    """Tabulates all holds of a learner with an arm.

    Observers with the infant's arm are numbered after the observers with the adult's arm.
    """
    rods, observers = len(tools) - 2, data.sizes["observer"]
    held = np.array([*np.repeat(np.arange(rods), 2), rods, rods + 1])
    table = tabulate_holds(data, tools, learner=learner, block=arm, objects=held)
    table["observer"] += ARMS.index(arm) * observers
    return table.assign(cycle=np.tile([*np.tile([1, 2], rods), 1, 1], observers))


EXPERIMENT = Experiment(run, read, predict, observers=48, no_memory="whose observers differ in learner and arm")
