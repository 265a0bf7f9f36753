"""What every experiment leaves behind, and its section with other numbers."""

import json
import types

import numpy as np

from affordance.experiments.runner import describe_faults, describe_few_observers
from affordance.reporting.section import render_section

COMMON = {"seed": (), "repeats": (), "run_shown": (), "wall_s": ()}


def check_results(folder, contract, figures):
    """Asserts that figures, trajectories, diagram, replay, section and numbers are there; returns the numbers.

    ``contract`` gives the shape of each number by its key.
    """
    for name in (*figures, "diagram"):
        assert (folder / f"{name}.svg").stat().st_size > 1000
        assert name == "diagram" or (folder / f"{name}.png").stat().st_size > 1000
    assert (folder / "diagram.dot").stat().st_size > 1000
    assert (folder / "replay.html").stat().st_size > 1e6
    assert (folder / "trajectories.nc").exists()
    numbers = json.loads((folder / "metrics.json").read_text(encoding="utf-8"))
    for key, shape in {**contract, **COMMON}.items():
        assert np.shape(numbers[key]) == shape, key
        assert np.isfinite(numbers[key]).all(), key
    assert numbers["versions"]["drake"]
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
    return render_section(experiment.section, numbers, {**facts, **experiment.list_facts(plan, numbers)})
