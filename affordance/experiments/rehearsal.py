"""Rehearsal of a protocol before observers run: names, figures, and claims on made-up numbers."""

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from affordance.exceptions import AffordanceError, BadValueError, suggest
from affordance.experiments.shared.presented import PresentationExperiment
from affordance.protocols.number_entries import Measure
from affordance.protocols.people import list_people
from affordance.protocols.rehearsal import imagine, rehearse
from affordance.reporting.claims import judge_claims

# Keys of metrics.json that every run has, and that any type of protocol may have.
RESERVED = (
    *("seed", "repeats", "run_shown", "config", "versions", "wall_s", "finished"),
    *("learners", "people", "kappa"),
)
# Figures that are not drawn by the protocol's own entries: Diagram of a simulation, and camera pictures.
_OF_SIMULATION, _OF_PICTURES = "diagram", "seen"
_SUFFIXES = (".png", ".svg")


def check_number_names(experiment: PresentationExperiment, given: Collection[str]) -> None:
    """Raises a BadValueError for a number called like another, its interval, or what every run says of itself."""
    intervals = {f"{name}_ci95": name for name, entry in experiment.numbers.items() if entry.interval}
    for name in experiment.numbers:
        key = f"numbers.{name}"
        if name in RESERVED or name in given:
            problem = "is the name of a value of every run, must be another"
            raise BadValueError(experiment.section, key, problem)
        if name in intervals:
            problem = f"is the name of the interval of {intervals[name]!r}, must be another"
            raise BadValueError(experiment.section, key, problem)


def rehearse_experiment(experiment: PresentationExperiment) -> dict[str, Any]:
    """Computes figures and numbers, with the right shapes and meaningless values, of made-up measurements.

    A figure, a number, or people's value of one that cannot be computed raises a BadValueError, which names the key.
    """
    check_figures(experiment)
    layout = experiment.layout
    drawn = [experiment.draw_measured(repeat) for repeat in (0, 1)]
    imagined = imagine(experiment.objects, layout, drawn)
    numbers = rehearse(experiment.section, experiment.numbers, layout, imagined)
    try:
        list_people(experiment.numbers, experiment.people, experiment.objects, experiment.blocks)
    except BadValueError:
        raise
    except AffordanceError as error:
        raise BadValueError(experiment.section, "numbers", str(error)) from error
    with np.errstate(all="ignore"):
        return experiment.assemble({learner.value: numbers for learner in experiment.learners})


def rehearse_claims(experiment: PresentationExperiment, numbers: Mapping[str, Any]) -> None:
    """Raises a BadValueError for a criterion that made-up numbers cannot decide; see ``rehearse_experiment``."""
    known = {
        **numbers,
        "seed": experiment.seed,
        "repeats": 2,
        "camera_caption": "",
        "faults": "",
        "few_observers": "",
    }
    known |= experiment.list_facts(None, numbers)
    for i, claim in enumerate(experiment.report.claims):
        for j, criterion in enumerate(claim.criteria):
            try:
                with np.errstate(all="ignore"):
                    judge_claims([claim.model_copy(update={"criteria": [criterion]})], known)
            except AffordanceError as error:
                key = f"report.claims[{i}].criteria[{j}]"
                raise BadValueError(experiment.section, key, str(error)) from error


def check_figures(experiment: PresentationExperiment) -> None:
    """Raises a BadValueError for a figure that cannot be drawn, or a caption of a figure that is not drawn."""
    layout = experiment.layout
    for name, entry in experiment.figures.items():
        key = f"figures.{name}"
        if entry.draw not in experiment.means.drawn:
            how = "lifts in closed form" if experiment.means.is_closed_form else "simulated presentations"
            problem = f"of {how} is {entry.draw!r}, must be one of {', '.join(experiment.means.drawn)}"
            raise BadValueError(experiment.section, f"{key}.draw", problem)
        if entry.draw == "objects":
            continue
        needed = Measure.FORCE if entry.draw == "lifts" else Measure.DROP
        done = layout.block[layout.find_measured(needed)]
        presented = {tool for block in done for tool in experiment.objects.groups[layout.blocks[block].objects]}
        for at, group in (("of", entry.of), ("decoy", entry.decoy), ("predicted_from", entry.predicted_from)):
            if group is not None and not presented.intersection(experiment.objects.groups[group]):
                what = "lifted from a clamp" if needed is Measure.FORCE else "moved"
                problem = f"is {group!r}, none of which is {what} in a measured presentation"
                raise BadValueError(experiment.section, f"{key}.{at}", problem)
    _check_captions(experiment, moves=bool(layout.find_measured(Measure.DROP).any()))


def _check_captions(experiment: PresentationExperiment, *, moves: bool) -> None:
    """Refuses captions of files that will not exist."""
    names = [*experiment.figures]
    names += [_OF_SIMULATION] if moves else []
    names += [_OF_PICTURES] if experiment.tools_observed else []
    files = [f"{name}{suffix}" for name in names for suffix in _SUFFIXES]
    for index, figure in enumerate(experiment.report.given.get("figures", ())):
        if figure.file not in files:
            shown = ", ".join(f"{name}.png" for name in names) or "none, as there are no figures"
            problem = f"is {figure.file!r}, which is not drawn, must be one of {shown}{suggest(figure.file, files)}"
            raise BadValueError(experiment.section, f"report.figures[{index}].file", problem)
