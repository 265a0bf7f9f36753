"""Study of the blows of Simulation IV, with a coarse map and short splines."""

import dataclasses
import functools

import numpy as np
import pytest
import xarray
from helpers.results_files import OF_STUDY, read_numbers, read_section

from affordance.exceptions import AffordanceError, StallError
from affordance.objects.tool import Grip
from affordance.reporting.section import render_section
from studies.hammering import blows
from studies.hammering.command import STUDY
from studies.hammering.optimal_swing import compare_swings
from studies.study import write_findings


@pytest.fixture
def is_coarse(monkeypatch):
    monkeypatch.setattr(blows, "_MAP_FORCES", 20)
    monkeypatch.setattr(blows, "_MAP_DENSITIES", 2)


@pytest.fixture(scope="module")
def study(hammering, hammering_plan):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(blows, "_MAP_FORCES", 20)
        patch.setattr(blows, "_MAP_DENSITIES", 2)
        patch.setattr(blows, "compare_swings", functools.partial(compare_swings, num_pieces=1))
        return blows.study_blows(hammering, hammering_plan, jobs=1)


@pytest.fixture(scope="module")
def findings(study, hammering):
    return blows.describe_blows(study, hammering)


def test_contact_simulation_confirms_that_the_cheaper_grip_changes_at_the_crossover(findings):
    numbers = findings.numbers
    below, above = numbers["force_crossover_checked"]
    assert below["force_demanded_N"] < numbers["force_crossover_N"] < above["force_demanded_N"]
    cheaper = [min(each["energy_true"], key=each["energy_true"].get) for each in (below, above)]
    assert cheaper == ["steel", "wood"]


def test_swings_by_other_criteria_are_better_by_these(findings, hammering_plan):
    for grip, swings in findings.numbers["swings"].items():
        assert swings["least_effort"]["effort"] < swings["least_acceleration"]["effort"]
        assert swings["least_work"]["energy"] < swings["least_acceleration"]["energy"]
        assert swings["least_acceleration"]["energy"] == pytest.approx(
            hammering_plan.simulated["stick"][grip].work, rel=0.03
        )


def test_yielding_nail_is_driven_as_deep_by_the_same_energy(findings, hammering_plan):
    for grip, blow in findings.numbers["yielding_nail"].items():
        assert blow["travel_m"] == pytest.approx(hammering_plan.simulated["stick"][grip].travel, rel=0.05)


def test_forces_are_checked_on_either_side_of_a_crossover_above_the_demanded_force(
    hammering, hammering_plan, study, is_coarse, monkeypatch
):
    """A crossover above a small demanded force, for which the steel end is cheaper, is checked on either side."""
    monkeypatch.setattr(blows, "_compare_swings", lambda *arguments: {})
    simulate = blows._simulate

    def simulate_stiff(*arguments, nail=None, **changes):
        """Simulates a blow, except that a nail that yields is left to another test."""
        return hammering_plan.simulated["stick"]["wood"] if nail else simulate(*arguments, **changes)

    monkeypatch.setattr(blows, "_simulate", simulate_stiff)
    (crossover,) = study.crossovers
    weaker = dataclasses.replace(hammering.task, force=0.95 * crossover)
    adapter = dataclasses.replace(hammering.adapter, task=weaker)
    found = blows.study_blows(dataclasses.replace(hammering, adapter=adapter), hammering_plan, jobs=1)
    assert found.crossovers == pytest.approx([crossover], abs=0.05)
    (below, dealt_below), (above, dealt_above) = found.checked.items()
    assert below < crossover < above
    assert weaker.force < above
    cheaper = [min(dealt, key=lambda grip: dealt[grip].work) for dealt in (dealt_below, dealt_above)]
    assert cheaper == ["steel", "wood"]


def test_study_goes_on_without_other_swings_where_none_is_found(hammering, hammering_plan, monkeypatch, caplog):
    def find_none(*arguments):
        raise AffordanceError("no motion keeps the limits")

    monkeypatch.setattr(blows, "compare_swings", find_none)
    tool, simulated = hammering.novel[0], hammering_plan.simulated["stick"]
    found = blows._compare_swings(
        tool.list_gripped(), hammering_plan.costs["stick"], simulated, hammering.settings, 1
    )
    assert found == {}
    assert "other swings than ours are not compared: no motion keeps the limits" in caplog.text


def test_study_goes_on_without_blows_that_fail_in_contact(hammering, hammering_plan, is_coarse, monkeypatch, caplog):
    """Blows that stall on a yielding nail, as those of a light arm do, are left out of the study and named."""

    def stall(*arguments, nail=None, **changes):
        if nail is not None:
            raise StallError("stick", 0.8, 200_000, ())
        return hammering_plan.simulated["stick"]["wood"]

    monkeypatch.setattr(blows, "simulate_blow", stall)
    monkeypatch.setattr(blows, "_compare_swings", lambda *arguments: {})
    found = blows.study_blows(hammering, hammering_plan, jobs=1)
    assert found.yielding == {}
    assert len(found.checked) == 2
    assert "left out of the study: the simulated blow with the stick stalls" in caplog.text
    assert not render(blows.describe_blows(found, hammering)).remarks


def test_study_of_three_grips_compares_the_two_cheapest(hammering, hammering_plan, is_coarse, monkeypatch):
    """A third grip 2 cm from the first, with the first's costs, is compared with the first."""

    def find_none(*arguments):
        raise AffordanceError("no other swing")

    simulated = hammering_plan.simulated["stick"]
    monkeypatch.setattr(blows, "compare_swings", find_none)
    monkeypatch.setattr(blows, "_simulate", lambda *arguments, **changes: simulated["wood"])
    stick, near = hammering.novel[0], np.eye(4)
    near[0, 3] = 0.02
    three = dataclasses.replace(stick, grips=(*stick.grips, Grip("near", near)))
    costs = {**hammering_plan.costs["stick"], "near": hammering_plan.costs["stick"]["wood"]}
    plan = hammering_plan._replace(
        costs={"stick": costs}, simulated={"stick": {**simulated, "near": simulated["wood"]}}
    )
    hammering = dataclasses.replace(hammering, novel=(three,))
    found = blows.study_blows(hammering, plan, jobs=1)
    assert simulated["wood"].work < simulated["steel"].work
    assert found.compared == ("wood", "near")
    assert found.map.work.shape[0] == 3
    assert blows.describe_blows(found, hammering).figures["map"]().axes


@pytest.mark.parametrize(
    ("true", "least", "most"),
    [(7850.0, 300.0, 11_340.0), (11_340.0, 300.0, 12_474.0), (19_300.0, 300.0, 21_230.0), (110.0, 100.0, 11_340.0)],
)
def test_map_holds_the_true_density(true, least, most):
    densities = blows.list_densities_of_map(true)
    assert (densities[0], densities[-1]) == pytest.approx((least, most))


def render(findings, **changes):
    return render_section(STUDY.section, {**findings.numbers, **changes}, findings.facts)


def find_table(section, title):
    (table,) = (table for table in section.tables if title in table.header)
    return table


def test_words_of_the_section_follow_its_numbers(findings):
    crossed = render(findings, force_crossovers_N=[133.0, 200.0, 300.0])
    assert "cross at 133, 200, 300 N" in find_table(crossed, "demanded force (N)").caption
    low, high = findings.numbers["force_crossover_checked"]
    deep = {**high, "travel_m": {"wood": 0.0073, "steel": 0.0071}}
    rows = find_table(render(findings, force_crossover_checked=[low, deep]), "demanded force (N)").rows
    assert rows[1][2] == "7.3 (wood), 7.1 (steel)"
    kinds = ("least_acceleration", "least_work", "least_effort")
    swings = {
        grip: {
            kind: {"energy": work, "effort": 1.0, "converged": grip == "wood"}
            for kind, work in zip(kinds, works, strict=True)
        }
        for grip, works in (("wood", (10.0, 3.0, 50.0)), ("steel", (15.0, 2.0, 40.0)))
    }
    rows = find_table(render(findings, swings=swings), "all searches converged").rows
    assert rows == [["wood", "10.00", "3.00", "50.00", "yes"], ["steel", "15.00", "2.00", "40.00", "no"]]


def test_without_a_crossover_or_other_swings_their_tables_are_left_out(findings):
    none = {"force_crossover_N": None, "force_crossovers_N": [], "force_crossover_checked": [], "swings": {}}
    assert len(render(findings).tables) == 2
    assert not render(findings, **none).tables


def test_study_writes_numbers_figure_map_and_section(findings, study, tmp_path):
    write_findings(findings, tmp_path / STUDY.folder, STUDY.section)
    folder = tmp_path / STUDY.folder
    numbers = read_numbers(folder)
    assert numbers.keys() == {*findings.numbers, *OF_STUDY}
    assert (folder / "map.png").stat().st_size > 10_000
    assert (tmp_path / "report.html").exists()
    assert [len(table["rows"]) for table in read_section(folder).tables] == [2, 2]
    with xarray.open_dataset(folder / "map.nc") as saved:
        np.testing.assert_array_equal(saved["work"].values, study.map.work)
        assert saved["grip"].values.tolist() == ["wood", "steel"]
