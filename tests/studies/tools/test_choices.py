"""Choice of a hammer's end, materials that the eye may take for a grey, and the study's section about them."""

import json

import numpy as np
import pytest
from helpers.refusals import refuse
from helpers.workshop import HAMMERS, MATERIALS

from affordance.belief.material_memory import MaterialMemory
from affordance.choice.listed_options import list_drawn_options
from affordance.choice.reach import Reach
from affordance.control.timed_path import load_path
from affordance.files.model_folder import MODELS
from affordance.proprioception.estimator import TorqueStatistics
from affordance.proprioception.torque_noise import WeberNoise
from affordance.settings import Settings
from affordance.vision.pixels.looks import Look
from studies.tools.data_set import LEARNING, DataSet, Deviation, Half
from studies.tools.first_touch import Score
from studies.tools.numbers import list_details, list_metrics
from studies.tools.observer import ToolsConfig
from studies.tools.report import count_right, describe
from studies.tools.seen import Outcome, Source, list_candidates, paint
from studies.tools.study import Choices, ToolsResult, Uncommon
from studies.tools.uncommon import weigh
from studies.tools.which_end import (
    AFTER,
    BEFORE,
    ONE_DENSITY,
    TRUE,
    build_beliefs,
    rank_grips,
)

SETTINGS = Settings()
REACH = Reach(load_path(MODELS / "paths" / "reach.yaml"))
MALLET, CLAW = HAMMERS["mallet"], HAMMERS["claw hammer"]


@pytest.fixture(scope="module")
def choices():
    tools = (MALLET,)
    experience = MaterialMemory.from_densities({each.colour: each.density for each in MATERIALS.values()})
    beliefs = build_beliefs(MATERIALS, experience, SETTINGS)
    found = rank_grips(list_drawn_options(tools), REACH, beliefs, SETTINGS, seed=0, num_samples=300)
    rankings = {
        (task, geometry, name): each
        for task in ("hammer", "reach")
        for geometry in ("drawing", "pictures")
        for name, each in found.items()
    }
    return Choices(tools, rankings, [])


def test_heavy_head_is_held_by_who_knows_and_by_who_does_not_with_less_certainty(choices):
    ranking = choices.rankings["reach", "drawing", TRUE]
    assert ranking.find_best_grip("mallet") == "head"
    assert ranking.list_of("mallet")[0].p_best_of_tool > 0.99
    before = choices.rankings["reach", "drawing", BEFORE]
    assert sum(each.p_best for each in before.ranked) == pytest.approx(1.0 - before.p_none)
    assert max(each.p_best for each in before.ranked) < 0.99
    assert {each.option.grip for each in before.ranked} == {"handle", "choked", "head"}


def test_one_density_knows_shapes_and_nothing_else(choices):
    beliefs = build_beliefs(MATERIALS, MaterialMemory(), SETTINGS)
    np.testing.assert_allclose(beliefs[ONE_DENSITY].belief.compute_mean(), SETTINGS.prior.mode, rtol=1e-4)
    assert count_right(choices, AFTER, "reach", "drawing") == (1, 1)


def test_grey_may_be_of_several_materials_and_brass_of_one():
    names = list_candidates(Look(MATERIALS["alloy_steel"].colour, 16.0), MATERIALS)
    assert len(names) > 1
    assert {"alloy_steel", "stainless_steel"} <= set(names)
    assert list_candidates(Look(MATERIALS["brass"].colour, 1.0), MATERIALS) == ("brass",)


def test_paint_changes_what_is_shown_and_nothing_else():
    painted = paint(CLAW, [(1.0, 0.0, 0.0), None])
    assert [part.looks_like.colour for part in painted.components] == [
        (1.0, 0, 0),
        CLAW.components[1].looks_like.colour,
    ]
    np.testing.assert_array_equal(painted.parameters, CLAW.parameters)


def test_objects_that_would_have_felt_otherwise_weigh_little(rng):
    """Weights agree with products of normal densities computed one joint at a time."""
    noise = WeberNoise(0.07, 0.1)
    pi = rng.uniform(0.1, 1.0, (5, 10))
    tau, tau_arm, Y = rng.standard_normal(2), rng.standard_normal(2), rng.standard_normal((2, 10))
    found = weigh(pi, TorqueStatistics(np.concatenate([tau, tau_arm, Y.ravel()]), 1), noise)
    expected = []
    for each in pi:
        predicted = tau_arm + Y @ each
        sd = noise.compute_sd(predicted)
        expected.append(np.prod(np.exp(-0.5 * ((tau - predicted) / sd) ** 2) / sd))
    np.testing.assert_allclose(found, np.array(expected) / max(expected))


def make_result(choices, **more):
    return ToolsResult(ToolsConfig(), {"own": choices}, Uncommon((), [], []), **more)


def test_metrics_have_the_keys_that_are_asked_for(choices):
    score = Score(10.0, 0.1, 0.1, 0.9, 0.9, 0.9)
    result = make_result(
        choices,
        parity={"a": Deviation(1e-3, 1e-4, 2e-3), "b": Deviation(2e-3, 2e-4, 1e-3)},
        scores={(Source.CAD, 1, Half.TEST): score},
        floors={"all steel": score},
        made_out={"a": Outcome(0.9), "b": Outcome(0.7), "c": Outcome(0.0, problem="nothing seen")},
        records={"none": {"ours": {"mass": 0.1, "com": 0.1, "inertia": 0.1, "coverage_mass": float("nan")}}},
    )
    metrics = json.loads(json.dumps(list_metrics(result), allow_nan=False))
    assert set(metrics) == {"parity", "first_touch", "floors", "records", "segmented", "grips"}
    assert metrics["parity"] == {"mass": 2e-3, "com_mm": pytest.approx(0.2), "inertia": 2e-3}
    assert metrics["first_touch"][0]["geometry"] == "cad"
    assert metrics["first_touch"][0]["half"] == "test"
    assert set(metrics["floors"]["all steel"]) == {"ade_g", "alde", "ape", "mnre"}
    assert metrics["records"]["none"]["ours"]["coverage_mass"] is None
    assert metrics["segmented"] == 1
    assert metrics["grips"][0]["tool"] == "mallet"
    assert list_details(result)["made_out"]["b"]["made_out"] is False


def test_without_the_data_set_its_numbers_are_missing(choices):
    metrics = list_metrics(make_result(choices))
    assert metrics["parity"]["mass"] is None
    assert metrics["segmented"] is None
    assert metrics["first_touch"] == []


def test_section_says_which_end_is_chosen(choices):
    section = describe(make_result(choices))
    assert section.finding.startswith(
        "After experience with other objects, the right end of our own hammers is chosen"
    )
    assert "for driving a nail in 1 of 1 cases by drawing" in section.finding
    assert "first choice the mallet, grip head (p = " in section.summary
    assert [claim.key for claim in section.claims] == ["blows_force", "blows_work"]
    assert not any(claim.met for claim in section.claims)  # without a blow


def test_folder_that_is_no_clone_is_refused(tmp_path):
    assert "has no folder 'data/Workshop Tools Dataset', must be a clone" in refuse(DataSet(tmp_path, MODELS).check)
    assert len(LEARNING) == 10
