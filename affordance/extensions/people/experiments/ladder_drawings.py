"""Figure and table of the ladder of learners: excursions, and what infants did."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from affordance.arrays import Array
from affordance.extensions.people.rivals import label_learner
from affordance.reporting.figures import DECOY_COLOUR, FONT_SIZE, OBJECT_COLOURS, tidy

ARMS = ("adult", "infant")
# What infants did at the age that each learner stands for. Sources: Bower 1974, Development in Infancy, on motor
# behaviour; for nine and twelve months a translation was read; eighteen months is cited from memory, unchecked.
# Mounoud and Bower's article was not read. The paper (I, IV-A) puts the last rung at nine months.
AGES = {
    "nothing_remembered": ("9 months", "the arm drops each time, even when the object was given several times"),
    "own_memory": ("12 months", "the drop is gone when the object is given again"),
    "density": ("18 months; the paper: 9 months", "a longer rod is expected to be heavier; a light one flies up"),
}


def tabulate(n: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> pd.DataFrame:
    """Tabulates what infants did and what each learner does: excursions, adult's arm / infant's arm, [cm]."""
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
    """Draws the excursions of each object: a row of panels for each arm, a column for each learner."""
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
