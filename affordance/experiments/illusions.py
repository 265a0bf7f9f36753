"""Size-weight illusion, material-weight illusion, and both crossed: designs, forces and judged heaviness.

Observers lift the family of each look ten times, and then test objects, which all weigh the same, twenty times each.
Predictions were stated before the first run (docs/heaviness.md). No published value of such a study was looked up.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd

from affordance.arrays import Array
from affordance.belief.learner import Learner
from affordance.experiments.lifts import Design, build_table, cylinder, repeat, run_lifts
from affordance.experiments.observers import Setup
from affordance.objects.tool import Tool

RADIUS, HEIGHTS = 0.0461, (0.06, 0.075, 0.105, 0.12)  # radius of all cylinders, and heights of a family, [m]
SMALL, MIDDLE, LARGE = 0.05, 0.09, 0.13  # heights of test objects, [m]
FAMILIAR, TESTED, LAST = 10, 20, 5  # cycles of the families and of the test objects; cycles averaged as "last"
PLAIN = {"plain": ("#8c8c8c", 1500.0)}  # look: colour, and density of its family, [kg/m^3]
LOOKS = {"light": ("#e8dcb5", 300.0), "dense": ("#5a6470", 2500.0)}


class Illusion(NamedTuple):
    """Design of an illusion: looks with their families, and test objects of one mass."""

    looks: Mapping[str, tuple[str, float]]  # colour and density of the family, [kg/m^3]
    tested: Mapping[str, tuple[str, float]]  # look, and height, [m]
    mass: float  # of every test object, [kg]


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


def make_objects(illusion: Illusion) -> list[Tool]:
    """Makes the objects of a design: the families of all looks, then the test objects."""
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
    """Returns the function that draws one observer's trials; every second observer has the reverse test order."""
    return partial(_draw, illusion)


def _draw(illusion: Illusion, observer: int, rng: np.random.Generator) -> pd.DataFrame:
    family = [f"{look} {1000 * height:g} mm" for look in illusion.looks for height in HEIGHTS]
    tested = [*illusion.tested] if observer % 2 == 0 else [*illusion.tested][::-1]
    blocks = [repeat(family, FAMILIAR, rng, block="family"), repeat(tested, TESTED, rng, block="test", order="fixed")]
    return pd.concat(blocks, ignore_index=True)


def build_trials(name: str, participants: int, *, seed: int = 0) -> pd.DataFrame:
    """Builds the trial table of a design, for ``affordance lift`` or for a laboratory."""
    return build_table(make_design(ILLUSIONS[name]), participants, seed=seed)


def run_illusion(name: str, setup: Setup, learners: Sequence[Learner] = ()) -> pd.DataFrame:
    """Lets observers of each learner do the design with a given name; returns a row for each lift."""
    illusion = ILLUSIONS[name]
    return run_lifts(name, setup, make_objects(illusion), make_design(illusion), learners)


def measure_contrasts(name: str, lifts: pd.DataFrame) -> pd.DataFrame:
    """Measures contrasts of force and heaviness between test objects, at the first lift and over the last five.

    A contrast is the natural logarithm of a ratio.

    Returns: A row for each observer and contrast: ``size`` (small over large), ``material`` (light over dense look),
        and ``interaction`` (the size contrast of the light look minus that of the dense look). ``began`` is the test
        object that came first.
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
