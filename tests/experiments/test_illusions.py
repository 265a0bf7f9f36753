"""Size-weight, material-weight and crossed designs: objects, trials, and contrasts by hand."""

import numpy as np
import pandas as pd
import pytest

from affordance.belief.learners import KINDS_DRAWN, OWN_MEMORY
from affordance.experiments.holds import compute_volume
from affordance.experiments.illusions import (
    ILLUSIONS,
    build_trials,
    make_objects,
    measure_contrasts,
    run_illusion,
)
from affordance.experiments.observers import Setup


@pytest.mark.parametrize("name", ILLUSIONS)
def test_test_objects_weigh_the_same_and_their_families_are_honest(name):
    tools = {tool.name: tool for tool in make_objects(ILLUSIONS[name])}
    tested = [tools.pop(each) for each in ILLUSIONS[name].tested]
    assert len({round(tool.mass, 12) for tool in tested}) == 1
    assert len({(compute_volume(tool), tool.components[0].looks_like.colour) for tool in tested}) == len(tested)
    by_look = {}
    for tool in tools.values():
        by_look.setdefault(tool.components[0].looks_like.colour, []).append(tool.mass / compute_volume(tool))
    assert all(len(each) == 4 and np.ptp(each) < 1e-9 * each[0] for each in by_look.values())
    assert {tool.components[0].looks_like.colour for tool in tested} == {*by_look}


@pytest.mark.parametrize("name", ILLUSIONS)
def test_trials_are_balanced_over_participants(name):
    table, tested = build_trials(name, 4), [*ILLUSIONS[name].tested]
    first = table[table["phase"] == "test"].groupby("participant")["object"].first()
    assert first.tolist() == [tested[0], tested[-1]] * 2
    counts = table.groupby(["participant", "phase", "object"]).size()
    assert set(counts[:, "family"]) == {10}
    assert set(counts[:, "test"]) == {20}
    pd.testing.assert_frame_equal(table, build_trials(name, 4))


def test_contrasts_by_hand():
    """Forces of e, e^2 and so on have logarithms that are added up in the head."""
    logs = {"small, light look": 4.0, "large, light look": 2.0, "small, dense look": 3.0, "large, dense look": 0.0}
    rows = [(0, "test", cycle, name, np.exp(value), 1.0) for cycle in range(1, 21) for name, value in logs.items()]
    lifts = pd.DataFrame(rows, columns=["observer", "block", "cycle", "object", "force", "heaviness"])
    found = measure_contrasts("crossed", lifts).set_index(["contrast", "of", "moment"])["value"]
    assert found["size", "force", "first"] == pytest.approx(2.5)
    assert found["material", "force", "last"] == pytest.approx(1.5)
    assert found["interaction", "force", "last"] == pytest.approx(-1.0)
    assert (found[:, "heaviness", :] == 0.0).all()


def test_illusion_outlives_the_forces_that_it_began_with(tmp_path):
    """With kinds forces come near the weight, and the light look is judged heavier still; without looks it is not."""
    lifts = run_illusion("material_weight", Setup(observers=4, out=tmp_path), [KINDS_DRAWN])
    found = measure_contrasts("material_weight", lifts).groupby(["of", "moment"])["value"].mean()
    assert found["force", "first"] < -1.0
    assert abs(found["force", "last"]) < 0.5 * abs(found["force", "first"])
    assert found["heaviness", "last"] > 0.1
    lifts = run_illusion("material_weight", Setup(observers=4, out=tmp_path), [OWN_MEMORY])
    found = measure_contrasts("material_weight", lifts).groupby(["of", "moment"])["value"].mean()
    assert found["force", "first"] == 0.0
    assert abs(found["heaviness", "last"]) < 0.1
