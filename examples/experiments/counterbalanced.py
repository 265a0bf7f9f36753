"""Counterbalanced weights in two groups: large objects are heavy or light, and then a new size is lifted.

Run this file with Python to write counterbalanced.csv again, then

    affordance lift --objects objects.yaml --trials counterbalanced.csv
"""

import numpy as np
import pandas as pd

from affordance.extensions.people.experiments.lifts import build_table, counterbalance, repeat

FAMILY = ["can_60mm", "can_80mm", "can_120mm"]
MASSES = {0: [0.4, 0.6, 0.8], 1: [0.8, 0.6, 0.4]}  # masses of the family in the groups "heavier" and "lighter", [kg]


def design(participant: int, rng: np.random.Generator) -> pd.DataFrame:
    """Draws the trials of one participant. The first order of sizes is balanced over participants."""
    first = repeat(counterbalance(FAMILY, participant // 2), 1, rng, block="learn", order="fixed")
    learn = pd.concat([first, repeat(FAMILY, 7, rng, block="learn")])
    masses = dict(zip(FAMILY, MASSES[participant % 2], strict=True))
    learn["mass"] = learn["object"].map(masses)
    return pd.concat([learn, pd.DataFrame({"block": ["test"], "cycle": 1, "object": "can_100mm", "mass": 0.6})])


if __name__ == "__main__":
    build_table(design, 12, groups=["heavier", "lighter"]).to_csv("counterbalanced.csv", index=False)
