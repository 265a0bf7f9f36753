"""Simulation I: what is asked of its objects, and its numbers against those of its data."""

import dataclasses
import itertools

import numpy as np
import pytest
import xarray as xr
from helpers.changed_files import change_file
from helpers.refusals import refuse
from helpers.results_files import read_numbers, read_section

from affordance.belief.prior import Prior
from affordance.exceptions import AffordanceError
from affordance.experiments import weight
from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.suite import run_suite
from affordance.objects.materials import load_materials

RODS = ["rod_10cm", "rod_15cm", "rod_20cm", "rod_25cm"]
BRASS, DECOY = "position: [0.050, 0, 0], material: brass", "material: beech, looks_like: brass"
ROD = (
    "  - name: rod_{0}cm\n    components:\n"
    "      - {{semi_axes: [0.{1}, 0.015, 0.015], position: [0.{1}, 0, 0], material: brass}}\n"
)
LONGER = (ROD.format(15, "075"), ROD.format(20, "100"), ROD.format(25, "125"))
REFUSED = {
    "two objects": (
        *(LONGER[0], "", LONGER[1], "", LONGER[2], ""),
        "weight.yaml: tools: has 2 entries, must have at least 3: two objects and the decoy",
    ),
    "grips": (
        *(BRASS + "}", BRASS + "}\n    grips: {near: {position: [0, 0, 0]}, far: {position: [0.1, 0, 0]}}"),
        "weight.yaml: tools: rod_10cm.grips: are near, far, must not be given here",
    ),
    "two looks": (
        *(BRASS, BRASS.replace("brass", "steel")),
        "weight.yaml: tools: look like brass, steel, must all look like one material (a decoy by its looks_like)",
    ),
    "a second decoy": (
        *(BRASS, BRASS.replace("brass", "steel, looks_like: brass")),
        "weight.yaml: tools: rod_10cm.components[0].looks_like: is 'brass', must be what it is made of, 'steel'",
    ),
    "no decoy": (
        *(DECOY, "material: brass"),
        "weight.yaml: tools: decoy: has a density of 8500 kg/m^3, must be less than the 8500 of brass",
    ),
    "a heavy rod": (
        *("[0.100, 0.015, 0.015]", "[0.100, 0.06, 0.06]"),
        "weight.yaml: tools: rod_20cm: weighs 12.8 kg and loads ",
    ),
}


@pytest.mark.parametrize("change", REFUSED.values(), ids=REFUSED)
def test_objects_that_make_no_experiment_are_refused(models, change):
    *texts, said = change
    change_file(models / "tools" / "weight.yaml", *texts)
    message = refuse(weight.read, Setup(models=models), error=AffordanceError)
    assert said in message


def test_what_the_paper_says_is_seen_with_two_observers(shipped):
    numbers = shipped.numbers
    assert all(claim.met for claim in shipped.claims)
    assert numbers["density_median"][0] < numbers["density_true"]
    assert (np.diff(np.subtract(numbers["density_p75"], numbers["density_p25"])) < 0).all()
    assert numbers["drop_m"][3] < 0.25 * numbers["drop_m"][0]
    assert numbers["decoy_rises"] == 1.0
    np.testing.assert_allclose(
        numbers["mass_true"], 8500.0 * 4 / 3 * np.pi * 0.015**2 * np.array([5, 7.5, 10, 12.5]) / 100
    )


def test_numbers_are_those_of_the_data(shipped):
    """The file holds heights and beliefs of all observers, from which the numbers follow with numpy alone."""
    with xr.open_dataset(shipped.folder / "data.nc") as opened:
        data = opened.load()
    assert data.height.dims == ("observer", "trial", "time")
    assert data.height.shape == (2, 5, 301)
    assert data.trial.values.tolist() == [*RODS, "decoy"]
    numbers, height = read_numbers(shipped.folder), data.height.values
    drops = np.maximum(0.0, -height.min(axis=2))[:, :4]
    np.testing.assert_allclose(numbers["drop_m"], drops.mean(axis=0))
    np.testing.assert_allclose(numbers["drop_growth_m"], np.diff(drops, axis=1).mean(axis=0))
    half = 12.7062 * drops.std(axis=0, ddof=1) / np.sqrt(2.0)  # Student's, 1 degree of freedom
    np.testing.assert_allclose(np.diff(numbers["drop_m_ci95"])[:, 0], 2.0 * half, rtol=1e-5)
    np.testing.assert_allclose(numbers["deviation_m"], np.abs(height[:, :4]).max(axis=2).mean(axis=0))
    np.testing.assert_allclose(numbers["decoy_lift_m"], height[:, 4].max(axis=1).mean())
    np.testing.assert_allclose(numbers["density_median"], np.median(data.density.values[:, :5, 1], axis=0))
    np.testing.assert_allclose(numbers["density_mode"], np.median(data.density_mode.values[:, :5], axis=0))
    np.testing.assert_allclose(numbers["log_evidence"], data.log_evidence.values.mean(axis=0))
    assert data["quantile"].values.tolist() == [0.25, 0.5, 0.75]


def test_motions_of_each_trial_are_those_of_its_own_heights(shipped, chain):
    """Heights by angles of each trial agree to 1e-12 m with those logged for the centre of its object."""
    data, tools = shipped.data, weight.read(shipped.setup)
    for trial, tool in enumerate(tools):
        q = data.q.values[trial]
        assert q.shape == (301, 7)
        heights = chain.compute_positions(q, tool.p_TTcentre)[:, 2]
        np.testing.assert_allclose(heights - heights[0], data.height.values[0, trial], atol=1e-12)
        slopes = (q[2:] - q[:-2]) / 0.02
        velocities = data.v.values[trial]
        # The first moments, in which an unheld arm begins to fall, are left out.
        np.testing.assert_allclose(slopes[5:], velocities[6:-1], atol=0.02 * np.abs(velocities).max() + 1e-9)


def test_experience_is_carried_from_trial_to_trial(shipped):
    tools = weight.read(shipped.setup)
    memories, records = weight.hold(shipped.setup, tools, 1)
    assert (len(memories), len(records)) == (6, 5)
    sds = [np.sqrt(memory.belief.covariance[0, 0]) for memory in memories[1:]]
    assert all(later < earlier for earlier, later in itertools.pairwise(sds))
    np.testing.assert_array_equal([each.height_centre for each in records], shipped.data.height.values[1])


def test_seed_decides_the_numbers(shipped, monkeypatch):
    monkeypatch.setattr(weight, "DURATION", 0.1)
    tools = weight.read(shipped.setup)[:2]
    first, again = (weight.observe(shipped.setup, tools, 0) for _ in range(2))
    assert first.identical(again)
    for other in (
        weight.observe(dataclasses.replace(shipped.setup, seed=1), tools, 0),
        weight.observe(shipped.setup, tools, 1),
    ):
        assert (first.density.values[1:] != other.density.values[1:]).all()


def test_words_and_tables_follow_objects_and_numbers(shipped):
    assert shipped.summary == (
        "2 observers held 4 rods of brass, and then a decoy that looks like them and is made of beech, for 3 s each."
    )
    assert f"sinks by {100.0 * shipped.numbers['drop_m'][0]:.1f} cm" in shipped.finding
    (table,) = read_section(shipped.folder).tables
    assert [row[0] for row in table["rows"]] == ["before", *(rod.replace("_", " ") for rod in RODS)]
    assert [row[2] for row in table["rows"]] == ["", *(f"{100.0 * drop:.2f}" for drop in shipped.numbers["drop_m"])]
    assert [*shipped.captions] == ["figure3", "figure4"]
    criteria = read_section(shipped.folder).claims["first_object"].criteria
    assert criteria[0]["value"].startswith(f"{100 * shipped.numbers['drop_m'][0]:.2f} cm")


def test_more_rods_of_another_material_are_held_and_drawn(models, tmp_path, monkeypatch):
    """Eight rods of rubber, more than there are colours for, and a decoy are run, drawn and described.

    This rubber is as dense as is believed before, so that the first rod does not sink, and no drop is less than its.
    """
    monkeypatch.setattr(weight, "DURATION", 0.1)
    shape = "semi_axes: [0.1, 0.015, 0.015], position: [0.1, 0, 0]"
    rod = f"  - name: rod_{{0}}\n    components: [{{{{{shape}, material: rubber{{1}}}}}}]\n"
    rods = [rod.format(number, "") for number in range(8)]
    decoy = rod.format("decoy", ", looks_like: rubber").replace("material: rubber", "material: oak")
    (models / "tools" / "weight.yaml").write_text("tools:\n" + "".join([*rods, decoy]), encoding="utf-8")
    rubber = load_materials(models / "materials.yaml")["rubber"].density
    change_file(models / "materials.yaml", f"density: {rubber:g}", f"density: {Prior().mode:g}")
    run_suite(["weight"], Setup(observers=2, models=models, out=tmp_path / "out"))
    section = read_section(tmp_path / "out" / "weight")
    assert "8 rods of rubber" in section.summary
    assert "is made of oak" in section.summary
    assert len(section.tables[0]["rows"]) == 9
    assert read_numbers(tmp_path / "out" / "weight")["drop_m"][0] == 0.0
    assert section.claims["drop_reduced"].criteria[1]["met"] is False
    assert {figure["file"] for figure in section.figures} == {"figure3.png", "figure4.png", "diagram.svg"}


def make_heights(drops, last):
    """Heights over three moments of two observers: each rod drops, and the decoy ends somewhere."""
    height = np.zeros((2, len(drops) + 1, 3))
    height[:, :-1, 1] = -np.array(drops)
    height[0, :, 2] = 0.01
    height[:, -1, 1] = [0.0, last]
    return height


def test_numbers_of_made_up_data_by_hand():
    data = xr.Dataset(
        {
            "height": (("observer", "trial", "time"), make_heights([0.2, 0.1], 0.3)),
            "density": (("observer", "moment", "quantile"), np.arange(24.0).reshape(2, 4, 3)),
            "density_mode": (("observer", "moment"), [[1.0, 2.0, 3.0, 4.0], [3.0, 4.0, 5.0, 6.0]]),
            **{
                name: (("observer", "trial"), [[1, 0, 2], [0, 0, 3]])
                for name in ("log_evidence", "periods_limited", "periods_failed", "samples_rejected")
            },
            "p_value": (("observer", "trial"), [[1e-9, 0.5, 1e-20], [0.2, 1e-6, 1e-20]]),
        }
    )
    tools = weight.read(Setup())
    numbers = weight.summarise(weight.measure(data), [tools[0], tools[1], tools[4]])
    np.testing.assert_allclose(numbers["drop_m"], [0.2, 0.1])
    np.testing.assert_allclose(numbers["drop_growth_m"], [-0.1])
    np.testing.assert_allclose(numbers["deviation_m"], [0.2, 0.1])
    assert numbers["decoy_lift_m"] == pytest.approx(0.5 * (0.01 + 0.3))
    assert numbers["decoy_rises"] == 1.0
    assert numbers["density_p25"].tolist() == [6.0, 9.0, 12.0]
    assert numbers["density_p75"].tolist() == [8.0, 11.0, 14.0]
    assert numbers["density_mode"].tolist() == [2.0, 3.0, 4.0]
    assert numbers["samples_rejected"].tolist() == [1, 0, 5]
    assert numbers["trials_outlier"].tolist() == [1, 0, 2]
    assert numbers["mass_true"].tolist() == [tools[0].mass, tools[1].mass]
    assert (numbers["decoy_mass_true"], numbers["decoy_density_true"]) == (tools[4].mass, 720.0)


KEPT = {
    "density_true": 8500.0,
    "density_p25": np.array([1500.0, 7400.0, 8000.0, 8100.0, 8200.0]),
    "density_median": np.array([3100.0, 8100.0, 8400.0, 8400.0, 8450.0]),
    "density_p75": np.array([5100.0, 8900.0, 8800.0, 8700.0, 8650.0]),
    "density_mode": np.array([1000.0, 8100.0, 8400.0, 8400.0, 8450.0]),
    "mass_true": np.array([0.4, 0.6, 0.8, 1.0]),
    "deviation_m": np.array([0.2125, 0.01, 0.005, 0.004]),
    "decoy_lift_m": 0.0825,
    "decoy_rises": 1.0,
}


@pytest.mark.parametrize(
    "drops",
    [
        (0.2125, 0.0040, 0.0090, 0.0140),
        (0.2125, 0.0100, 0.0200, 0.0300),
        (0.2125, 0.2125, 0.2125, 0.2126),
        (0.01, 0.02, 0.03, 0.04),
    ],
)
def test_drops_that_grow_are_not_reduced(drops):
    claims = {claim.key: claim for claim in weight.judge({**KEPT, "drop_m": np.array(drops)})}
    assert not claims["drop_reduced"].met


def test_order_of_trials_decides_whether_the_drop_is_reduced():
    for order in itertools.permutations((0.2125, 0.0400, 0.0120, 0.0060)):
        claims = {claim.key: claim for claim in weight.judge({**KEPT, "drop_m": np.array(order)})}
        assert claims["drop_reduced"].met == (list(order) == sorted(order, reverse=True))
