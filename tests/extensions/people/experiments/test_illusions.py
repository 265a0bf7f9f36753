"""Size-weight, material-weight and crossed designs: objects, trials, and contrasts by hand."""

import numpy as np
import pandas as pd
import pytest

from affordance.belief.learners import KINDS_DRAWN
from affordance.experiments.shared.holds import compute_volume
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments import illusions
from affordance.extensions.people.experiments.illusions import (
    EFFECTS,
    ILLUSIONS,
    STATED,
    build_trials,
    judge,
    make_objects,
    measure_contrasts,
    run_illusion,
)
from affordance.extensions.people.rivals import OWN_MEMORY


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


BY_LOOK = ("density", "kinds_map", "kinds_drawn", "own_and_shared")


def make_contrasts(change=()):
    """Makes contrasts of four observers as they were stated; a change gives one of them another mean.

    Args:
        change: Pairs of a place (design, contrast, learner, force or heaviness, moment) and a mean; None is any.
    """
    rows = []
    for learner in (*BY_LOOK, "own_memory"):
        for design, contrast, _ in EFFECTS:
            heaviness = STATED.get(contrast, 0.0)
            values = {"force": (-1.0, -0.1), "heaviness": (heaviness, heaviness)}
            if learner == "density":
                values = {
                    "force": (-1.0, -0.95),
                    "heaviness": (heaviness, heaviness * (1.0 - 0.5 * (contrast != "size"))),
                }
            if learner == "own_memory" and contrast != "size":
                values = {"force": (0.0, 0.0), "heaviness": (0.0, 0.0)}
            for of, pair in values.items():
                for moment, mean in zip(("first", "last"), pair, strict=True):
                    place = (design, contrast, learner, of, moment)
                    for wanted, other in change:
                        mean = other if all(w in (None, p) for w, p in zip(wanted, place, strict=True)) else mean
                    rows += [(observer, f"object {observer % 2}", *place, mean) for observer in range(4)]
    columns = ["observer", "began", "design", "contrast", "learner", "of", "moment", "value"]
    return pd.DataFrame(rows, columns=columns)


# One contrast that is changed, and the claims that it contradicts.
CHANGED = {
    "nothing": ((), set()),
    "large is heavier at first": ((("size_weight", "size", "own_and_shared", "heaviness", "first"), -0.1), {"sign"}),
    "large is heavier at last": ((("crossed", "size", "own_and_shared", "heaviness", "last"), -0.1), {"sign"}),
    "a larger illusion": ((("size_weight", "size", "kinds_map", "heaviness", "last"), 0.2), {"size"}),
    "effects do not add": ((("crossed", "interaction", "kinds_drawn", "heaviness", "last"), 0.02), {"crossed"}),
    "one effect is reversed": (
        (("crossed", "size", "kinds_map", "heaviness", "last"), -0.09),
        {"sign", "crossed", "persistence"},
    ),
    "small is pushed harder": ((("crossed", "size", "own_and_shared", "force", "first"), 0.5), {"forces"}),
    "forces of kinds stay": ((("crossed", "material", "kinds_map", "force", "last"), -0.5), {"persistence"}),
    "the illusion goes": ((("crossed", "size", "kinds_map", "heaviness", "last"), 0.05), {"persistence"}),
    "one density adapts": ((("size_weight", "size", "density", "force", "last"), -0.5), {"persistence"}),
    "delta rules do not": ((("crossed", "size", "own_and_shared", "force", "last"), -0.5), {"persistence"}),
    "looks stay apart": ((("material_weight", "material", "density", "heaviness", "last"), 0.21), {"material"}),
    "objects have looks": ((("material_weight", "material", "own_memory", "heaviness", "last"), 0.1), {"own_memory"}),
}  # fmt: skip


@pytest.mark.parametrize("what", CHANGED)
def test_claims_hold_for_what_was_stated_and_each_can_fail(what):
    change, contradicted = CHANGED[what]
    claims = judge(make_contrasts([change] if change else []))
    assert {each.key for each in claims if not each.met} == contradicted


def test_claim_about_the_order_can_fail():
    contrasts = make_contrasts()
    contrasts["value"] += 0.2 * (contrasts["began"] == "object 1")
    assert "order" in {each.key for each in judge(contrasts) if not each.met}


def test_results_have_contrasts_claims_and_tables_for_a_laboratory(tmp_path, monkeypatch):
    monkeypatch.setattr(illusions, "FAMILIAR", 2)
    monkeypatch.setattr(illusions, "TESTED", 5)
    setup = Setup(observers=2, out=tmp_path)
    results = illusions.run(setup)
    rows = results.tables[next(iter(results.tables))]
    assert len(rows) == len(EFFECTS) * len(results.learners)
    assert f"{results.numbers['contrasts'][0]['mean']:+.2f} (" in rows.iloc[0]["force, first"]
    for write in results.files.values():
        write(tmp_path)
    assert set(pd.read_csv(tmp_path / "lifts_size_weight.csv")["object"]) == {
        tool.name for tool in make_objects(ILLUSIONS["size_weight"])
    }
    assert len(pd.read_csv(tmp_path / "trials_crossed.csv")["participant"].unique()) == 48
    assert all(draw() for _, draw in results.figures.values())
    values = illusions.predict(setup).values
    assert values["density"]["size_weight_size_force"].shape == (2,)
