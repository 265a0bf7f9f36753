"""Results of each of the paper's simulations: files and numbers as documented, and what their sections say."""

import dataclasses
from typing import NamedTuple

import numpy as np
import pytest
from helpers.results_files import check_names, check_results, read_section
from helpers.short_holds import with_settings

from affordance.experiments.shared import choosing
from affordance.proprioception.faults import Faults
from affordance.vision.features import FeatureSource


class Results(NamedTuple):
    """What a simulation leaves behind.

    Attributes:
        shapes: Shapes of numbers, by key.
        figures: Names of figures.
        headings: Headings of docs/results.md below which its keys stand.
        met: Keys of claims that even few observers meet.
        rows: First cells of its tables' rows, by the table's number.
    """

    shapes: dict[str, tuple[int, ...]]
    figures: tuple[str, ...]
    headings: tuple[str, ...]
    met: tuple[str, ...]
    rows: dict[int, list[str]]


CHOSEN = {
    **{"p_correct": (7,), "p_correct_ci95": (7, 2), "p_correct_bayes": (7,), "p_correct_headed_tool": (7,)},
    **dict.fromkeys(("energy_ratio_true", "off_axis_2mm_change"), ()),
}
TOOLS = ["stick", "hammer"]
RESULTS = {
    "weight": Results(
        {
            **dict.fromkeys(("density_p25", "density_median", "density_p75"), (5,)),
            **dict.fromkeys(("drop_m", "deviation_m", "mass_true"), (4,)),
            **{"drop_m_ci95": (4, 2), "decoy_lift_m_ci95": (2,)},
            **dict.fromkeys(("density_true", "decoy_lift_m", "decoy_rises", "decoy_density_true"), ()),
        },
        ("figure3", "figure4"),
        ("weight",),
        ("decoy_lifted",),
        {0: ["before", "rod 10cm", "rod 15cm", "rod 20cm", "rod 25cm"]},
    ),
    "com": Results(
        {
            **dict.fromkeys(("mass_true", "p_ToTcm_x_true", "height_extreme_m", "deviation_m", "p_value_test"), (3,)),
            **{"height_extreme_m_ci95": (3, 2), "samples_rejected_test": (3,), "trials_outlier_test": (3,)},
            **dict.fromkeys(("mass_error", "com_error_m", "samples_rejected", "trials_outlier"), ()),
        },
        ("figure5", "figure6"),
        ("com",),
        ("decoy_lifted",),
        {0: ["steel far", "steel near", "decoy"], 1: ["beech", "steel"]},
    ),
    "reach": Results(
        CHOSEN, ("figure7", "figure8", "path"), ("reach and hammer", "reach"), ("correct_grip",), {0: TOOLS}
    ),
    "hammer": Results(
        {**CHOSEN, "force_demanded_N": (), "tip_energy": ()},
        ("figure9", "figure10", "blow"),
        ("reach and hammer", "hammer"),
        ("correct_grip", "sufficient_force"),
        {0: TOOLS},
    ),
}


@pytest.mark.parametrize("name", RESULTS, scope="module")
def test_results_are_as_documented(name, experiment, plan, folder):
    expected = RESULTS[name]
    numbers = check_results(folder, expected.shapes, expected.figures, *expected.headings)
    check_names(experiment, plan, numbers)


@pytest.mark.parametrize("name", RESULTS, scope="module")
def test_section_says_met_or_not_of_every_claim(name, experiment, folder):
    section = read_section(folder)
    assert set(section.claims) == {claim.key for claim in experiment.report.claims}
    for claim in section.claims.values():
        assert isinstance(claim.met, bool)
        for criterion in claim.criteria:
            assert any(character.isdigit() for character in criterion["value"])
            assert criterion["bound"]
    assert all(section.claims[key].met for key in RESULTS[name].met)
    for table in section.tables:
        assert all(len(row) == len(table["header"]) for row in table["rows"]), table["caption"]
    for number, cells in RESULTS[name].rows.items():
        assert [row[0] for row in section.tables[number]["rows"]] == cells


CHOICES = pytest.mark.parametrize("name", ["reach", "hammer"], scope="module")


@CHOICES
def test_correct_grip_is_the_cheaper_one_of_the_simulated(name, numbers):
    energy = numbers["energy_true"]
    assert energy.keys() == {"steel", "wood"}
    assert energy[numbers["correct_grip"]] == min(energy.values())
    assert numbers["energy_ratio_true"] == pytest.approx(max(energy.values()) / min(energy.values()))


@CHOICES
def test_what_is_true_depends_neither_on_sight_nor_on_faults(name, experiment, plan, monkeypatch):
    """What is simulated of the first tool is the same for features from pictures and a heavier arm."""
    monkeypatch.setattr(choosing, "measure_changes", lambda *arguments, **options: {})
    settings = dataclasses.replace(
        experiment.settings, feature_source=FeatureSource.PIXELS, faults=Faults(arm_mass_factor=1.05)
    )
    again = dataclasses.replace(with_settings(experiment, settings), novel=experiment.novel[:1]).plan(jobs=1)
    for grip, simulated in plan.simulated["stick"].items():
        other = again.simulated["stick"][grip]
        assert other.work == simulated.work
        if name == "reach":
            assert other.error == simulated.error
        else:
            assert other.force == simulated.force
            np.testing.assert_array_equal(again.costs["stick"][grip].speeds, plan.costs["stick"][grip].speeds)
    seen, told = again.choices["stick"], plan.choices["stick"]
    assert (len(seen.options[0].features[0].deformations), len(told.options[0].features[0].deformations)) == (9, 0)
