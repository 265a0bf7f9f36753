"""Files that every experiment leaves behind, and its section with other numbers."""

import json
import re
import types
from pathlib import Path

import numpy as np

from affordance.experiments.protocol_runs import list_names
from affordance.experiments.runner import describe, describe_faults, describe_few_observers

DOCS = Path(__file__).parents[2] / "docs" / "results.md"
COMMON = {"seed": (), "repeats": (), "run_shown": (), "wall_s": ()}
# Entries of every study's metrics.json, and of every experiment's, in addition to the numbers.
OF_STUDY = {"versions", "commit", "finished"}
OF_RUN = {*COMMON, *OF_STUDY, "config", "setup", "inputs"}


def find_documented_keys(*headings):
    """Keys in the tables below headings of docs/results.md: the words between backticks in their first column."""
    parts = re.split(r"^### (.*)\n", DOCS.read_text(encoding="utf-8"), flags=re.MULTILINE)
    sections = dict(zip(parts[1::2], parts[2::2], strict=True))
    rows = [line.split("|")[1] for heading in headings for line in sections[heading].splitlines() if line[:1] == "|"]
    return {key for row in rows for key in re.findall(r"`(.+?)`", row)}


def check_keys(numbers, *headings):
    """Asserts that docs/results.md names every key of a metrics.json, and no other."""
    assert set(numbers) == find_documented_keys("Every experiment", *headings)


def read_numbers(folder):
    """Returns the content of the metrics.json of a folder."""
    return json.loads((folder / "metrics.json").read_text(encoding="utf-8"))


def check_results(folder, shapes, figures, *headings):
    """Asserts that figures, trajectories, diagram, replay, section and numbers are there; returns the numbers.

    ``shapes`` gives the shape of each number by its key; ``headings`` of docs/results.md name all keys.
    """
    for name in figures:
        assert (folder / f"{name}.svg").exists()
        assert (folder / f"{name}.png").stat().st_size > 1000
    assert (folder / "diagram.svg").stat().st_size > 1000
    assert (folder / "diagram.dot").stat().st_size > 1000
    assert (folder / "replay.html").stat().st_size > 1e6
    assert (folder / "trajectories.nc").exists()
    numbers = read_numbers(folder)
    for key, shape in {**shapes, **COMMON}.items():
        assert np.shape(numbers[key]) == shape, key
        assert np.isfinite(numbers[key]).all(), key
    assert numbers["versions"]["drake"]
    check_keys(numbers, *headings)
    return numbers


def read_section(folder):
    """The section that an experiment left in its folder; claims by their keys."""
    content = json.loads((folder / "section.json").read_text(encoding="utf-8"))
    content["claims"] = {claim["key"]: types.SimpleNamespace(**claim) for claim in content["claims"]}
    return types.SimpleNamespace(**content)


def render(experiment, plan, numbers, *, repeats=3, **changes):
    """The section of an experiment with changed numbers."""
    facts = {
        "repeats": repeats,
        "seed": experiment.seed,
        "camera_caption": "",
        "faults": describe_faults(experiment.settings.faults),
        "few_observers": describe_few_observers(repeats),
    }
    numbers = {**numbers, **changes}
    return describe(experiment, numbers, {**facts, **experiment.list_facts(plan, numbers)})


def check_names(experiment, plan, numbers):
    """Asserts that the names of numbers and facts which an experiment knows beforehand are those that there are."""
    facts = {"repeats", "seed", "camera_caption", "faults", "few_observers", *experiment.list_facts(plan, numbers)}
    assert list_names(experiment) == (set(numbers) - OF_RUN) | facts
