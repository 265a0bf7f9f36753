"""Choice of the next object after an odd one, and of the time to stop.

The design has not been tested with people. Observers first hold a rod of steel and a rod of beech, and then an odd
rod, which looks like steel but is made of beech. From then on they choose the next object: another rod that looks
like steel, another rod of beech, or a rod or block of brass, although no tool is made of brass. They know their
tasks: to grip a stick and a hammer, both made of steel and beech, for reaching and for driving a nail.

Expected: observers that value holds by their use for these tasks are uncertain about the density of objects that look
like steel, because two such rods differ. They next lift the third such rod, and then stop. The first two claims were
written before any result was seen, and the third after the simulation but before any data from people.

    affordance run examples/experiments/next_lift.py
"""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from affordance.arrays import about
from affordance.belief.learners import list_learners
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.demand import Criterion
from affordance.choice.options import Option
from affordance.choice.pricing import plan_options
from affordance.choice.tasks import load_task
from affordance.experiments.shared.drawings import replay_holds
from affordance.experiments.shared.experiment import Experiment
from affordance.experiments.shared.holds import describe_holds, tabulate_holds
from affordance.experiments.shared.objects import check_can_be_held, read_tools
from affordance.experiments.shared.observer_numbers import ObserverNumbers
from affordance.experiments.shared.observers import OBSERVER_SHOWN, Setup, run_observers
from affordance.experiments.shared.results import Results
from affordance.extensions.advice.next_hold import Question, advise_hold
from affordance.extensions.people.rivals import label_learner
from affordance.objects.tool import Tool, list_colours
from affordance.reporting.claims import ClaimResult, check, claim, with_interval
from affordance.reporting.formatting import count_observers, label
from affordance.reporting.object_drawings import Drawing, draw_objects
from affordance.runs.random_streams import Stream
from affordance.simulation.trial import Observer, get_runner
from affordance.simulation.trial_record import TrialRecord
from affordance.vision.eye import measure_drawing

# Files in the model folder. The first two tools are a stick and a hammer.
OBJECTS, TOOLS = "tools/next_lift.yaml", "tools/novel.yaml"
TASKS = ("reach", "hammer")
FAMILIAR = ("rod of steel", "rod of beech")
ODD, LIKE_IT, BRASS = "odd rod", "third rod of steel look", ("rod of brass", "block of brass")
DURATION = 1.0  # duration of each hold, [s]
SAMPLES = 1000  # number of samples of the belief with which an observer chooses
CAPTION = (
    "Mean order of lifts, counted from the odd rod. If the other four came in random order, the third rod of steel "
    "look would be lifted in lift 3.5 on average, and next in a quarter of cases."
)
MEANINGS = {
    "place_of_like": "lift of the third rod of steel look; the odd rod is lift 1",
    "like_next": "share of observers who lift it next after the odd rod; 0.25 by chance",
    "place_of_brass": "mean lift of the two brass objects; 3.5 by chance",
    "stopped": "share of observers who would rather have stopped before each lift",
    "lifts_until_stop": "number of lifts before the observer would stop, from the odd rod on, at most 5",
}


def run(setup: Setup) -> Results:
    """Runs the experiment."""
    things, _ = read(setup)
    data = collect(setup)
    each = {learner: measure(data.sel(learner=learner), things) for learner in data.learner.values}
    learners = {str(learner): summarise(numbers) for learner, numbers in each.items()}
    first, *_ = learners.values()
    numbers = {**first, "learners": learners}
    shown, records = hold(setup.change(learner=list_learners(setup.settings.learner)[0]), things, OBSERVER_SHOWN)[::2]
    free = shown[len(FAMILIAR) :]
    shares = [f"{found['like_next']:.0%} ({label_learner(learner)})" for learner, found in learners.items()]
    return Results(
        title="What is lifted next after an odd object?",
        summary=(
            f"{count_observers(setup.observers)} of each learner held a rod of steel and one of beech, then an"
            " odd rod that looks like steel but is made of beech. Then they chose what to hold next, so as to grip a"
            " stick and a hammer well: another rod of each look, or two objects of brass, of which no tool is made."
            " Nobody has done this experiment yet."
        ),
        finding=f"Share that lifts a rod of the same look next after the odd rod: {', '.join(shares)}.",
        data=data,
        numbers=numbers,
        claims=judge(learners),
        figures={
            "things": (
                "Objects that may be held. The first, the odd rod, is not made of what it looks like.",
                partial(draw_things, things[len(FAMILIAR) :]),
            )
        },
        tables={CAPTION: tabulate(learners)},
        lifts=pd.concat([tabulate_lifts(data.sel(learner=learner), things) for learner in data.learner.values]),
        diagram=lambda: get_runner(setup.settings).get_diagram().diagram,
        replay=replay_holds(
            [things[index] for index in free],
            records[len(FAMILIAR) :],
            setup.settings,
            f"next lift, seed {setup.seed}",
        ),
        seen=things,
        learners=[*learners],
    )


def predict(setup: Setup) -> ObserverNumbers:
    """Computes the outcome measures of each observer of every learner."""
    things, _ = read(setup)
    data = collect(setup)
    return ObserverNumbers(
        {str(each): measure(data.sel(learner=each), things) for each in data.learner.values}, MEANINGS
    )


def read(setup: Setup) -> tuple[Sequence[Tool], Sequence[Tool]]:
    """Loads the objects, and the tools whose grips are chosen."""
    things, tools = read_tools(setup.models, OBJECTS), read_tools(setup.models, TOOLS)[:2]
    check_can_be_held(setup.models / OBJECTS, things, setup.settings)
    return things, tools


def collect(setup: Setup) -> xr.Dataset:
    """Simulates the observers of each learner."""
    things, _ = read(setup)
    parts = [
        run_observers("next_lift", setup.change(learner=learner), observe, things).assign_coords(learner=learner.name)
        for learner in list_learners(setup.settings.learner)
    ]
    return xr.concat(parts, "learner", combine_attrs="override")


def hold(
    setup: Setup, things: Sequence[Tool], observer: int
) -> tuple[list[int], list[MaterialMemory], list[TrialRecord], list[bool]]:
    """Simulates the holds of one observer: familiar rods, the odd rod, and then chosen objects.

    Returns:
        Index of the object in each trial; memories before the first and after each trial; records; and for each trial
        with a chosen object, True if the observer would have stopped before it.
    """
    settings, runner = setup.settings, get_runner(setup.settings)
    names = [thing.name for thing in things]
    familiar = [things[names.index(name)] for name in FAMILIAR]
    colours = list_colours(familiar)
    memory = setup.start_memory(observer).add_colours(colours, settings.prior).restrict_to(colours)
    hand = Observer(runner, memory, duration=DURATION, remembered=colours)
    order: list[int] = []
    memories, records = [memory], []
    rng = np.random.default_rng([setup.seed, observer, Stream.ORDER])
    for trial, place in enumerate(rng.permutation(len(familiar))):
        order.append(names.index(FAMILIAR[place]))
        records.append(hand.hold(familiar[place], (setup.seed, observer, trial)))
        memories.append(hand.memory)
    colours = list_colours(things)
    memory = hand.memory.add_colours(colours, settings.prior).restrict_to(colours)
    hand = Observer(runner, memory, duration=DURATION, remembered=colours)
    left = [index for index, name in enumerate(names) if name not in FAMILIAR]
    stopped: list[bool] = []
    for number in range(len(left)):
        offered = [names.index(ODD)] if number == 0 else left
        seed = (setup.seed, observer, Stream.CHOSEN, number)
        chosen, stops = choose([things[index] for index in offered], things, hand.memory, setup, seed)
        stopped.append(stops or any(stopped))
        order.append(offered[chosen])
        left.remove(offered[chosen])
        records.append(hand.hold(things[order[-1]], (setup.seed, observer, len(FAMILIAR) + number)))
        memories.append(hand.memory)
    return order, memories, records, stopped


def choose(
    offered: Sequence[Tool], things: Sequence[Tool], memory: MaterialMemory, setup: Setup, seed: tuple[int, ...]
) -> tuple[int, bool]:
    """Chooses the object that is most useful to hold for the tasks.

    Returns:
        Index of the chosen object in ``offered``, and True if no object is worth holding.
    """
    _, tools = read(setup)
    options = [
        Option(tool.name, grip.name, measure_drawing(tool), grip.X_TG) for tool in tools for grip in tool.grips
    ]
    questions = [
        Question(name, plan_options(options, load_task(setup.models, name), setup.settings)) for name in TASKS
    ]
    advice = advise_hold(
        offered,
        questions,
        memory,
        setup.settings,
        criterion=Criterion.WORK,
        looks={thing.name: [part.appearance for part in measure_drawing(thing)] for thing in things},
        num_samples=SAMPLES,
        seed=int(np.random.default_rng(seed).integers(2**31)),
    )
    return [thing.name for thing in offered].index(advice.next_name), bool(advice.stop)


def observe(setup: Setup, things: Sequence[Tool], observer: int) -> xr.Dataset:
    """Simulates one observer. Returns its holds, its stopping trial, and their results."""
    order, memories, records, stopped = hold(setup, things, observer)
    return xr.Dataset(
        {
            "object": ("trial", order, about("1", "index of the object")),
            "stopped": (
                "free",
                stopped,
                about("1", "whether the observer would rather have stopped before the lift"),
            ),
            **describe_holds([things[index] for index in order], memories, records, setup.settings),
        }
    )


def measure(data: xr.Dataset, things: Sequence[Tool]) -> dict[str, xr.DataArray]:
    """Computes the outcome measures of each observer. The odd rod is lift 1."""
    names = [thing.name for thing in things]
    objects = data.object.isel(trial=slice(len(FAMILIAR), None))
    place = xr.DataArray(np.arange(1.0, objects.sizes["trial"] + 1.0), dims="trial")
    like = place.where(objects == names.index(LIKE_IT)).max("trial")
    return {
        "place_of_like": like,
        "like_next": like == 2.0,
        "place_of_brass": place.where(objects.isin([names.index(name) for name in BRASS])).mean("trial"),
        "stopped": data.stopped,
        "lifts_until_stop": (1 - data.stopped).sum("free"),
    }


def summarise(each: Mapping[str, xr.DataArray]) -> dict[str, Any]:
    """Computes summaries of the outcome measures over observers, as in metrics.json."""
    return {
        **with_interval("place_of_like", each["place_of_like"]),
        **with_interval("like_next", each["like_next"].astype(float)),
        **with_interval("place_of_brass", each["place_of_brass"]),
        "stopped": each["stopped"].mean("observer").values,
        **with_interval("lifts_until_stop", each["lifts_until_stop"].astype(float)),
        "lifts_median": float(each["lifts_until_stop"].median()),
    }


def judge(n: Mapping[str, Mapping[str, Any]]) -> list[ClaimResult]:
    """Tests the predictions."""
    one, kinds = n["density"], n["kinds_map"]
    return [
        claim("like_next", "ours, a prediction", "After the odd rod, the rod that looks like it is lifted next.",
              check("share of observers, one density for each colour", one["like_next"], at_least=0.5)),
        claim("brass_last", "ours, a prediction", "Objects of a material that no tool is made of are lifted last.",
              check("mean lift of brass, one density for each colour", one["place_of_brass"], at_least=4),
              check("mean lift of brass, kinds, most probable", kinds["place_of_brass"], at_least=4)),
        claim("three_lifts", "ours, a prediction; written after simulation, before any people's data",
              "Three lifts are enough, counting the odd rod.",
              check("median lifts, one density for each colour", one["lifts_median"], at_least=3, at_most=3),
              check("median lifts, kinds, most probable", kinds["lifts_median"], at_least=3, at_most=3)),
    ]  # fmt: skip


def tabulate(learners: Mapping[str, Mapping[str, Any]]) -> pd.DataFrame:
    """Tabulates the order and number of lifts for each learner."""
    rows = {
        label_learner(learner): {
            "lift of the third rod of steel look": f"{found['place_of_like']:.2f}",
            "lifted next after the odd rod": f"{found['like_next']:.0%}",
            "mean lift of brass": f"{found['place_of_brass']:.2f}",
            "lifts before stopping": f"{found['lifts_until_stop']:.2f}",
        }
        for learner, found in learners.items()
    }
    return pd.DataFrame.from_dict(rows, orient="index").rename_axis("learner")


def tabulate_lifts(data: xr.Dataset, things: Sequence[Tool]) -> pd.DataFrame:
    """Tabulates all holds of one learner's observers."""
    table = tabulate_holds(data, things, learner=str(data.learner.values), block="free", objects=data.object.values)
    table.loc[table["lift"] <= len(FAMILIAR), "block"] = "familiar"
    return table.assign(cycle=1)


def draw_things(things: Sequence[Tool]) -> Any:
    """Draws the objects among which observers choose.

    The first, the odd rod, is drawn as it looks and as it is made.
    """
    odd, *others = things
    drawings = [Drawing(odd, f"1: {label(odd.name)}, as it looks")]
    drawings += [Drawing(odd, f"1: {label(odd.name)}, as it is made", as_made=True)]
    drawings += [Drawing(thing, f"{number}: {label(thing.name)}") for number, thing in enumerate(others, start=2)]
    return draw_objects(drawings, columns=2)


EXPERIMENT = Experiment(
    run, read, predict, observers=40, no_memory="whose observers differ in their learner", every_learner=True
)
