"""One setting from end to end: files, table, section, and a second run."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from helpers.results_files import find_documented_keys, read_numbers
from helpers.shared import compute_once
from helpers.study_runs import run_study
from matplotlib.figure import Figure

from affordance.belief.material_memory import MaterialMemory
from affordance.exceptions import AffordanceError
from affordance.files.model_folder import MODELS
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.trial import TrialRunner
from studies.robustness import command, holding, study
from studies.robustness import evaluate as evaluate_module
from studies.robustness.assumptions import list_defaults, sample_settings
from studies.robustness.build import build_world
from studies.robustness.claims import list_claims
from studies.robustness.command import describe_outcome
from studies.robustness.evaluate import evaluate_setting
from studies.robustness.holding import Held, compare_with_simulated

LOADED = study.load()
# Claims that `affordance run all` judges, without headlines.
JUDGED = [name for name, claim in list_claims().items() if claim.source != "README"]


@pytest.fixture(scope="module", autouse=True)
def _shorter_holds():
    """Holds of a third of the duration, as drops and lifts come in their first second."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(holding, "HOLD_DURATION", 1.1)
        yield


@pytest.fixture(scope="module")
def defaults(_shorter_holds, tmp_path_factory):
    """Outcome of the simulations' own setting, with as many observers as they have."""
    return compute_once(tmp_path_factory, "robustness_default", lambda: LOADED.evaluate(None))


def test_default_meets_all_that_the_simulations_meet(defaults):
    """The default setting meets all claims and headlines but one: after two trials the right end is not certain."""
    setting, outcome = defaults
    assert setting == list_defaults(LOADED.assumptions)
    assert not any(outcome.reasons.values())
    unmet = [name for name, held in outcome.outcomes.items() if held != 1.0]
    assert sorted(unmet) == ["hammer.after_two", "reach.after_two"]
    assert [outcome.numbers[name]["p_correct"][2] for name in ("reach", "hammer")] == [
        pytest.approx(0.99, abs=0.005)
    ] * 2
    assert set(JUDGED) <= set(outcome.outcomes)
    weight, com, reach, hammer = (outcome.numbers[name] for name in ("weight", "com", "reach", "hammer"))
    # Each drop is smaller than the last, as `affordance run weight` finds of the same 200, who sink as they learn.
    np.testing.assert_allclose(weight["drop_m"], [0.2128, 0.0076, 0.0038, 0.0023], rtol=0.25)
    assert (np.diff(weight["drop_m"]) < -1e-3).all()
    assert 0.06 < weight["decoy_lift_m"] < 0.1
    assert weight["density_median"][0] == pytest.approx(3105.0, abs=1.0)
    assert com["mass_error"] < 0.1
    assert (reach["correct_grip"], hammer["correct_grip"]) == ("steel", "wood")
    assert outcome.numbers["tasks"]["effort_differs"]


def test_as_many_choose_as_in_the_simulations(defaults):
    """Claims are judged with the probabilities of 200 observers, as in the simulations."""
    _, outcome = defaults
    assert LOADED.num_observers == 200
    for name in ("reach", "hammer"):
        numbers = outcome.numbers[name]
        below, above = np.moveaxis(numbers["p_correct_ci95"], -1, 0)
        assert (below <= numbers["p_correct"]).all()
        assert (numbers["p_correct"] <= above).all()
        # The SD of a probability is at most that of one choice.
        assert (above - below)[1] < 2.0 * 1.98 * np.sqrt(0.25 / 199)
    for held in outcome.held.values():
        assert {len(each.motions.heights) for each in held.tools} == {200}


def test_interpolated_motions_are_those_of_full_holds(defaults):
    """Interpolated heights agree to the bound with full holds of every judged object, for two observers of all."""
    _, outcome = defaults
    runner = TrialRunner(DEFAULT_SETTINGS)
    largest = {}
    for name, held in outcome.held.items():
        for each in held.tools:
            density = each.believed[:, 0]
            for observer in set(density.argsort()[[40, -1]].tolist()) if density[0] != density[1] else [0]:
                memory = MaterialMemory.from_densities(dict(zip(each.colours, each.believed[observer], strict=True)))
                full = runner.run_hold(each.tool, memory, duration=holding.HOLD_DURATION).height_centre
                error = float(np.abs(each.motions.heights[observer] - full).max())
                largest[name] = max(largest.get(name, 0.0), error)
    assert sum(len(held.tools) for held in outcome.held.values()) == 8
    assert max(largest.values()) < study.INTERPOLATION_BOUND
    assert 0.02 < outcome.simulated < 0.2  # else nothing would be interpolated


def test_motions_that_are_wrong_are_found(defaults):
    """The comparison with full holds finds motions that are off by 0.1 mm, and none otherwise to 1e-9 m."""
    setting, outcome = defaults
    world = build_world(setting, MODELS, DEFAULT_SETTINGS)
    (rod, *_) = outcome.held["weight"].tools
    alone = Held({}, (rod,))
    assert compare_with_simulated(world, alone) < 1e-9
    off = rod.motions._replace(heights=rod.motions.heights + 1e-4)
    assert compare_with_simulated(world, Held({}, (rod._replace(motions=off),))) == pytest.approx(1e-4, rel=1e-6)


def test_setting_is_described_with_its_claims(defaults):
    setting, outcome = defaults
    lines = describe_outcome(setting, outcome)
    assert "  weber_fraction: 0.07" in lines
    assert "  tasks.opposite_grips: holds" in lines
    assert "  hammer.sufficient_force: holds" in lines
    assert any(line.startswith("  reach.p_correct = [") for line in lines)


def test_runs_are_kept_and_reported(tmp_path, monkeypatch, defaults):
    """The simulations' setting is evaluated first, outside the sample; two settings are compared with full holds."""
    _, outcome = defaults
    evaluated, proven = [], []

    def evaluate(setting, *, seed, proves, **others):
        index = len(evaluated) - 1  # after the setting of the simulations
        evaluated.append(setting)
        proven.append(proves)
        held = {name: float(index < 0 or index % 3 > 0) for name in outcome.outcomes}
        reasons = {**outcome.reasons, "reach": "no plan" if index == 4 else ""}
        error = (3e-6 if index < 0 else 4e-6) if proves else np.nan
        return outcome._replace(outcomes=held, reasons=reasons, interpolation_error=error)

    monkeypatch.setattr(study, "evaluate_setting", evaluate)
    monkeypatch.setattr("studies.study.find_commit", lambda: "0123abc")
    with monkeypatch.context() as undrawn:
        undrawn.setattr(Figure, "savefig", lambda figure, path, **options: Path(path).touch())
        run_study(command.STUDY, "--repeats", 5, "--jobs", 1, "--out", tmp_path)
    run_study(command.STUDY, "--repeats", 12, "--jobs", 1, "--out", tmp_path)
    sample = sample_settings(LOADED.assumptions, 12, 0)
    assert evaluated == [list_defaults(LOADED.assumptions), *sample]
    assert proven == [True, True, *[False] * 11]
    numbers = read_numbers(tmp_path / "robustness")
    assert set(numbers) == find_documented_keys("Every experiment", "Robustness") - {"run_shown"}
    assert numbers["settings"] == 12
    assert numbers["commit"] == "0123abc"
    assert set(JUDGED) <= set(numbers["default_meets"])
    assert len(numbers["default_meets"]) >= 18
    assert numbers["default_fails"] == []
    assert numbers["interpolation_proven"] is True
    assert numbers["interpolation_error_m"] == 4e-6
    assert numbers["proven_in"] == [0]
    assert numbers["simulated"] == 0.0
    assert numbers["claims"]["reach.learned"]["text"] == "After 6 trials at least 95 of 100 choices are correct."
    claim = numbers["claims"]["reach.after_one"]
    assert claim["holds"] == pytest.approx(8 / 12)
    assert {"holds", "ci95", "strongest_assumption"} <= set(claim)
    assert claim["fails_in"] == [0, 3, 6, 9]
    assert numbers["reasons"]["reach"] == {"the controller finds no plan": 1}
    with (tmp_path / "robustness" / "settings.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["setting"] for row in rows if row["reach.after_one"] == "0"] == ["0", "3", "6", "9"]
    assert float(rows[5]["weber_fraction"]) != float(rows[6]["weber_fraction"])
    section = json.loads((tmp_path / "robustness" / "section.json").read_text(encoding="utf-8"))
    assert not section["claims"][0]["met"]  # twelve settings are not three hundred
    assert (tmp_path / "robustness" / "robustness.png").stat().st_size > 10_000
    assert "The multiverse" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_a_blow_that_cannot_be_simulated_leaves_the_force_unjudged(monkeypatch):
    """A blow that cannot be simulated leaves the force unjudged, and the correct grip judged."""

    def fail(*_):
        raise AffordanceError("it passes through the nail")

    for name in ("simulate_blow", "measure_rods", "measure_centre_of_mass"):  # the last two save time
        monkeypatch.setattr(evaluate_module, name, fail)
    setting = list_defaults(LOADED.assumptions)
    outcome = evaluate_setting(
        setting, seed=0, models=MODELS, settings=DEFAULT_SETTINGS, num_observers=2, simulates_contact=True
    )
    assert outcome.numbers["hammer"]["force_ratios"] is None
    assert np.isnan(outcome.outcomes["hammer.sufficient_force"])
    assert outcome.outcomes["hammer.correct_grip"] == 1.0
    assert (outcome.reasons["hammer"], outcome.reasons["com"]) == ("", "it passes through the nail")


def test_claims_are_drawn_by_experiment(monkeypatch):
    """Headlines of an experiment stand with its own claims, whatever their place among all claims."""
    drawn = []
    monkeypatch.setattr(study, "draw_multiverse", lambda claims, *others, **arrays: drawn.extend(claims))
    claim = {"holds": 0.5, "ci95": [0.4, 0.6], "null_level": 0.1, "first_order": {"x": 0.0}}
    LOADED.draw({"claims": dict.fromkeys(("reach.chance", "hammer.chance", "reach.after_one", "com.mass"), claim)})
    assert drawn == ["com: mass", "reach: chance", "reach: after one", "hammer: chance"]
