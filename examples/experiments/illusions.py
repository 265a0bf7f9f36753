"""Size-weight illusion, material-weight illusion, and both combined: lift forces and judged heaviness.

Observers lift a family of objects for each look ten times, and then each test object twenty times. All test objects
weigh the same. The claims were stated before the first run, without looking up published values of such studies.
Several claims were wrong (docs/heaviness.md).

    affordance run examples/experiments/illusions.py
"""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from affordance.arrays import Array
from affordance.belief.learner import Learner
from affordance.belief.learners import list_learners
from affordance.experiments.shared.experiment import Experiment
from affordance.experiments.shared.holds import select_columns
from affordance.experiments.shared.observer_numbers import ObserverNumbers
from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.results import Results
from affordance.extensions.people.experiments.lifts import (
    Design,
    build_table,
    check_can_be_lifted,
    cylinder,
    repeat,
    run_lifts,
)
from affordance.extensions.people.participant import LiftSettings
from affordance.extensions.people.rivals import OWN_AND_SHARED, OWN_MEMORY, label_learner
from affordance.files.atomic import write_text
from affordance.objects.tool import Tool
from affordance.reporting.claims import ClaimResult, check, claim
from affordance.reporting.figures import FONT_SIZE, OBJECT_COLOURS, tidy
from affordance.reporting.formatting import count_observers

OBSERVERS = 48  # default number of observers of each learner
RADIUS, HEIGHTS = 0.0461, (0.06, 0.075, 0.105, 0.12)  # radius of all cylinders, and heights of a family, [m]
SMALL, MIDDLE, LARGE = 0.05, 0.09, 0.13  # heights of test objects, [m]
FAMILIAR, TESTED, LAST = 10, 20, 5  # cycles of the families and of the test objects; cycles averaged as "last"
PLAIN = {"plain": ("#8c8c8c", 1500.0)}  # look: colour, and density of its family, [kg/m^3]
LOOKS = {"light": ("#e8dcb5", 300.0), "dense": ("#5a6470", 2500.0)}


class Illusion(NamedTuple):
    """Design of an illusion: looks with their families, and test objects of one mass."""

    looks: Mapping[str, tuple[str, float]]  # colour and density of the family, [kg/m^3]
    tested: Mapping[str, tuple[str, float]]  # look, and height, [m]
    mass: float  # mass of each test object, [kg]


ILLUSIONS = {
    "size_weight": Illusion(PLAIN, {"small": ("plain", SMALL), "large": ("plain", LARGE)}, 0.9),
    "material_weight": Illusion(
        LOOKS, {"light look": ("light", MIDDLE), "dense look": ("dense", MIDDLE)}, 0.52
    ),
    "crossed": Illusion(
        LOOKS,
        {
            "small, light look": ("light", SMALL),
            "large, light look": ("light", LARGE),
            "small, dense look": ("dense", SMALL),
            "large, dense look": ("dense", LARGE),
        },
        0.52,
    ),
}  # fmt: skip
# Effects in the order of figure and table: design, contrast, and the ratio whose logarithm is the effect.
EFFECTS = (
    ("size_weight", "size", "small over large"),
    ("material_weight", "material", "light look over dense look"),
    ("crossed", "size", "small over large"),
    ("crossed", "material", "light look over dense look"),
    ("crossed", "interaction", "size: light look over dense look"),
)
# Sizes of the two illusions for an exponent of 0.1 and constant beliefs about the families.
STATED = {"size": 0.1 * np.log(LARGE / SMALL), "material": 0.1 * np.log(2500.0 / 300.0)}


def run(setup: Setup) -> Results:
    """Runs the experiment."""
    lifts = collect(setup)
    groups = lifts.groupby(["design", "learner"], sort=False)
    contrasts = groups.apply(lambda own: measure_contrasts(str(own.name[0]), own)).reset_index()
    found = summarise(contrasts)
    last = found.xs(("heaviness", "last"), level=("of", "moment"))["mean"]
    learners = [*dict.fromkeys(contrasts["learner"])]
    described = [
        f"{label_learner(learner)} {last['size_weight', 'size', learner]:+.2f} and"
        f" {last['material_weight', 'material', learner]:+.2f}"
        for learner in learners
    ]
    return Results(
        title="Is the smaller, or the lighter-looking, of two equal weights judged heavier?",
        summary=(
            f"{count_observers(setup.observers)} of each learner lifted families of cylinders, then test objects of"
            " one mass. A contrast is the logarithm of the ratio of two forces, or of two judgements of heaviness, of"
            " the smaller or lighter-looking object over the other."
        ),
        finding=f"Contrasts of heaviness at the end, by size and by material: {'; '.join(described)}.",
        data=lifts,
        # A single observer has no standard error.
        numbers={"contrasts": found.reset_index().astype(object).replace(np.nan, None).to_dict("records")},
        claims=judge(contrasts),
        figures={
            "contrasts": (
                "Contrasts of force and heaviness between test objects of the same mass, with 95 % intervals.",
                partial(draw, found),
            )
        },
        tables={"Contrasts, means over observers; in brackets their standard errors.": tabulate(found)},
        files={name: partial(_write_tables, name, lifts[lifts["design"] == name]) for name in ILLUSIONS},
        learners=learners,
    )


def predict(setup: Setup) -> ObserverNumbers:
    """Computes contrasts of heaviness and force in the last lifts, for each observer of every learner."""
    values: dict[str, dict[str, Array]] = {}
    for (design, learner), own in collect(setup).groupby(["design", "learner"], sort=False):
        contrasts = measure_contrasts(str(design), own)
        for (name, of), each in contrasts[contrasts["moment"] == "last"].groupby(["contrast", "of"], sort=False):
            values.setdefault(str(learner), {})[f"{design}_{name}_{of}"] = each["value"].to_numpy()
    meanings = {
        f"{design}_{name}_{of}": f"log ratio of {of} in the last lifts of {design}, {ratio}"
        for design, name, ratio in EFFECTS
        for of in ("force", "heaviness")
    }
    return ObserverNumbers(values, meanings)


def read(setup: Setup) -> list[list[Tool]]:
    """Builds the objects of each design, and checks that the arm can hold them."""
    tools = [make_objects(illusion) for illusion in ILLUSIONS.values()]
    for name, own in zip(ILLUSIONS, tools, strict=True):
        check_can_be_lifted(name, own, setup.settings)
    return tools


def collect(setup: Setup) -> pd.DataFrame:
    """Simulates all designs with observers of each learner. Returns one row per lift, with its ``design``."""
    learners = [*list_learners(setup.settings.learner), OWN_MEMORY, OWN_AND_SHARED]
    return pd.concat(
        [run_illusion(name, setup, learners).assign(design=name) for name in ILLUSIONS], ignore_index=True
    )


def make_objects(illusion: Illusion) -> list[Tool]:
    """Builds the objects of a design: the families of all looks, and then the test objects."""
    tools = []
    for look, (colour, density) in illusion.looks.items():
        for height in HEIGHTS:
            mass = density * np.pi * RADIUS**2 * height
            name = f"{look} {1000 * height:g} mm"
            tools.append(cylinder(name, radius=RADIUS, height=height, mass=mass, colour=colour))
    for name, (look, height) in illusion.tested.items():
        colour = illusion.looks[look][0]
        tools.append(cylinder(name, radius=RADIUS, height=height, mass=illusion.mass, colour=colour))
    return tools


def make_design(illusion: Illusion) -> Design:
    """Returns the function that draws the trials of one observer.

    Test objects are in reverse order for every second observer.
    """
    return partial(_draw, illusion)


def _draw(illusion: Illusion, observer: int, rng: np.random.Generator) -> pd.DataFrame:
    family = [f"{look} {1000 * height:g} mm" for look in illusion.looks for height in HEIGHTS]
    tested = [*illusion.tested] if observer % 2 == 0 else [*illusion.tested][::-1]
    blocks = [repeat(family, FAMILIAR, rng, block="family"), repeat(tested, TESTED, rng, block="test", order="fixed")]
    return pd.concat(blocks, ignore_index=True)


def build_trials(name: str, participants: int, *, seed: int = 0) -> pd.DataFrame:
    """Builds the trial table of a design, for ``affordance lift`` or a laboratory."""
    return build_table(make_design(ILLUSIONS[name]), participants, seed=seed)


def run_illusion(name: str, setup: Setup, learners: Sequence[Learner] = ()) -> pd.DataFrame:
    """Simulates a design, given by name, with observers of each learner. Returns one row per lift."""
    illusion = ILLUSIONS[name]
    return run_lifts(f"illusions/{name}", setup, make_objects(illusion), make_design(illusion), learners)


def measure_contrasts(name: str, lifts: pd.DataFrame) -> pd.DataFrame:
    """Computes contrasts of force and heaviness between test objects, in the first lift and over the last five lifts.

    A contrast is the natural logarithm of a ratio.

    Returns:
        One row per observer and contrast: ``size`` (small over large), ``material`` (light over dense look), and
        ``interaction`` (size contrast of the light look minus size contrast of the dense look). ``began`` is the
        first test object.
    """
    rows = []
    tested = lifts[lifts["block"] == "test"]
    for observer, own in tested.groupby("observer"):
        for column in ("force", "heaviness"):
            logs = own.assign(log=np.log(own[column])).pivot(index="cycle", columns="object", values="log")
            moments = {"first": logs.iloc[0], "last": logs.tail(LAST).mean()}
            for moment, values in moments.items():
                for contrast, value in _contrast(name, values).items():
                    rows.append((observer, own["object"].iloc[0], contrast, column, moment, value))
    return pd.DataFrame(rows, columns=["observer", "began", "contrast", "of", "moment", "value"])


def _contrast(name: str, logs: pd.Series) -> dict[str, float]:
    if name == "size_weight":
        return {"size": logs["small"] - logs["large"]}
    if name == "material_weight":
        return {"material": logs["light look"] - logs["dense look"]}
    table: Array = np.array(
        [[logs[f"{size}, {look} look"] for look in ("light", "dense")] for size in ("small", "large")]
    )
    return {
        "size": float((table[0] - table[1]).mean()),
        "material": float((table[:, 0] - table[:, 1]).mean()),
        "interaction": float(table[0, 0] - table[1, 0] - table[0, 1] + table[1, 1]),
    }


def summarise(contrasts: pd.DataFrame) -> pd.DataFrame:
    """Computes ``mean`` and standard error ``se`` of each contrast, by design, learner, ratio (``of``) and moment."""
    groups = contrasts.groupby(["design", "contrast", "learner", "of", "moment"], sort=False)["value"]
    return pd.DataFrame({"mean": groups.mean(), "se": groups.sem()})


def judge(contrasts: pd.DataFrame) -> list[ClaimResult]:
    """Tests the claims that were stated before the first run, for each learner."""
    found = summarise(contrasts)
    first, last = (found["mean"].xs(moment, level="moment") for moment in ("first", "last"))
    kinds, by_look = ("kinds_map", "kinds_drawn"), ("density", "kinds_map", "kinds_drawn", "own_and_shared")
    effects = [(design, name) for design, name, _ in EFFECTS if name != "interaction"]
    single = effects[:2]

    def get(values: pd.Series, of: str, learners: Sequence[str], which: Sequence[tuple[str, str]]) -> Array:
        return np.array([values[(*effect, learner, of)] for learner in learners for effect in which])

    def compute_share(of: str, learners: Sequence[str], which: Sequence[tuple[str, str]]) -> Array:
        return get(last, of, learners, which) / get(first, of, learners, which)

    size = [STATED[name] for _ in kinds for _, name in single]
    sem = [2.0 * found["se"][(*effect, who, "heaviness", "last")] for who in kinds for effect in single]
    interaction = np.abs(get(last, "heaviness", kinds, [("crossed", "interaction")]))
    least = get(last, "heaviness", kinds, effects[2:]).reshape(len(kinds), 2).min(axis=1)
    at_end = contrasts[(contrasts["of"] == "heaviness") & (contrasts["moment"] == "last")]
    by_order = at_end[at_end["design"] != "crossed"].groupby(["design", "learner", "began"])["value"].mean().unstack()
    orders = (by_order.max(axis=1) - by_order.min(axis=1)).to_numpy()
    source = "ours, stated before the first run"
    return [
        # Values are in the order of by_look or kinds; for each learner, those of the effects.
        claim("sign", source,
              "With densities by look, the smaller and the lighter-looking object is judged heavier, first and last.",
              check("contrast of heaviness, first lift", get(first, "heaviness", by_look, effects), above=0.0),
              check("contrast of heaviness, last lifts", get(last, "heaviness", by_look, effects), above=0.0)),
        claim("size", source,
              "With kinds, the illusion has the size that the exponent gives if beliefs about families stay.",
              check("distance of the last contrast of heaviness from it, less two standard errors",
                    np.abs(get(last, "heaviness", kinds, single) - size) - sem, at_most=0.0)),
        claim("crossed", source, "With kinds, the effects of size and material add up.",
              check("smaller effect", least, above=0.0),
              check("interaction over the smaller effect", interaction / np.abs(least), below=0.1)),
        claim("forces", source, "With densities by look, first forces have the opposite sign.",
              check("contrast of force, first lift", get(first, "force", by_look, effects), below=0.0)),
        claim("persistence", source, "With kinds, forces adapt and the illusion lasts; with one density both stay.",
              check("contrast of force, last over first, kinds", np.abs(compute_share("force", kinds, effects)),
                    below=1.0 / 3.0),
              check("contrast of heaviness, last over first, kinds", compute_share("heaviness", kinds, effects),
                    above=0.8),
              check("contrast of force, last over first, own and shared memory",
                    np.abs(compute_share("force", ["own_and_shared"], effects)), below=1.0 / 3.0),
              check("contrast of force by size, last over first, one density",
                    compute_share("force", ["density"], effects[:1]), at_least=0.9)),
        claim("material", source, "With one density, the illusion of material shrinks as its two looks approach.",
              check("contrast of heaviness by material, last over first",
                    compute_share("heaviness", ["density"], effects[1:2]), below=0.9)),
        claim("own_memory", source, "A memory of single objects has the illusion of size, and none of material.",
              check("contrast of heaviness by size, last lifts",
                    get(last, "heaviness", ["own_memory"], effects[:1]), above=0.0),
              check("contrast by material", np.abs(get(last, "heaviness", ["own_memory"], effects[1:2])),
                    below=0.01)),
        claim("order", source, "It does not matter which test object comes first.",
              check("difference between the orders in the last contrast of heaviness", orders, below=0.1)),
    ]  # fmt: skip


def tabulate(found: pd.DataFrame) -> pd.DataFrame:
    """Tabulates contrasts by effect and learner.

    Columns are force and heaviness, first and last.
    """
    cells = [f"{mean:+.2f} ({se:.2f})" for mean, se in zip(found["mean"], found["se"], strict=True)]
    table = pd.Series(cells, found.index).unstack(["of", "moment"], sort=False)
    table.columns = table.columns.map(", ".join)
    return table.rename(index=label_learner, level="learner").reset_index().set_index("design")


def _write_tables(name: str, lifts: pd.DataFrame, folder: Path) -> None:
    for file, table in (("trials", build_trials(name, OBSERVERS)), ("lifts", select_columns(lifts))):
        write_text(folder / f"{file}_{name}.csv", table.to_csv(index=False, lineterminator="\n"))


def draw(found: pd.DataFrame) -> Figure:
    """Plots contrasts with a panel per effect and a row per learner.

    First lifts are open, last lifts filled.
    """
    figure = Figure(figsize=(10.0, 6.2), layout="constrained")
    panels = figure.subplots(2, 2, sharey=True)
    learners = [*dict.fromkeys(found.index.get_level_values("learner"))]
    for panel, (design, name, ratio) in zip(panels.flat, EFFECTS, strict=False):
        for row, learner in enumerate(learners):
            for of, colour, shift in (("force", OBJECT_COLOURS[0], -0.15), ("heaviness", OBJECT_COLOURS[2], 0.15)):
                for moment, fill in (("first", "white"), ("last", colour)):
                    place = (design, name, learner, of, moment)
                    panel.errorbar(
                        found["mean"][place], row + shift, xerr=1.96 * found["se"][place], fmt="o", color=colour,
                        markerfacecolor=fill,
                        label=f"{of}, {moment} lift{'s' * (moment == 'last')}" if row == 0 else None,
                    )  # fmt: skip
        panel.axvline(0.0, color="0.7", linewidth=0.8)
        panel.set_title(f"{design.replace('_', '-')}: {name}", fontsize=FONT_SIZE)
        panel.set_xlabel(f"log ratio, {ratio}")
        tidy(panel)
    panels[0, 0].set_yticks(range(len(learners)), [label_learner(each) for each in learners])
    panels[0, 0].invert_yaxis()
    figure.legend(*panels[0, 0].get_legend_handles_labels(), ncols=4, frameon=False, loc="outside lower center")
    return figure


EXPERIMENT = Experiment(
    run,
    read,
    predict,
    observers=OBSERVERS,
    no_memory="in which nothing is felt",
    every_learner=True,
    settings=LiftSettings,
)
