"""One setting from end to end, with few observers: files, table, section, and running it again."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from affordance.experiments.suite import run_suite
from affordance.files.model_folder import MODELS
from affordance.settings import DEFAULT_SETTINGS
from studies.robustness import experiment as study
from studies.robustness.assumptions import list_defaults
from studies.robustness.command import describe_outcome
from studies.robustness.evaluate import Effort, evaluate_setting

FEW = Effort(num_observers=6, num_held=1)
LOADED = replace(study.load(), effort=FEW)


@pytest.fixture(scope="module")
def defaults():
    """What the simulations' own setting gives; its index leaves contact out."""
    setting = list_defaults(LOADED.assumptions)
    outcome = evaluate_setting(setting, seed=0, index=1, models=MODELS, settings=DEFAULT_SETTINGS, effort=FEW)
    return setting, outcome


def test_defaults_give_what_the_simulations_give(defaults):
    """Numbers of 200 observers in the Diagram, by results of the simulations."""
    _, outcome = defaults
    assert not any(outcome.reasons.values())
    weight, com, reach, hammer = (outcome.numbers[name] for name in ("weight", "com", "reach", "hammer"))
    assert weight["drop_m"][0] == pytest.approx(0.2128, abs=2e-4)  # all observers are alike before the first
    assert 0.06 < weight["decoy_lift_m"] < 0.1
    assert weight["density_median"][0] == pytest.approx(3105.0, abs=1.0)
    assert com["mass_error"] < 0.1
    assert (reach["correct_grip"], hammer["correct_grip"]) == ("steel", "wood")
    for numbers in (reach, hammer):
        assert numbers["p_correct"][0] == pytest.approx(0.5, abs=0.03)
        assert numbers["p_correct"][-1] > 0.95
    assert outcome.numbers["tasks"]["effort_differs"]
    assert np.isnan(outcome.outcomes["hammer.sufficient_force"])
    assert outcome.outcomes["tasks.opposite_grips"] == 1.0


def test_setting_is_described_with_its_claims(defaults):
    setting, outcome = defaults
    lines = describe_outcome(setting, outcome)
    assert "  weber_fraction: 0.07" in lines
    assert "  tasks.opposite_grips: holds" in lines
    assert "  hammer.sufficient_force: not judged" in lines
    assert any(line.startswith("  reach.p_correct = [") for line in lines)


def test_runs_are_kept_and_reported(tmp_path, monkeypatch, defaults):
    _, outcome = defaults
    evaluated = []

    def evaluate(setting, *, index, **others):
        evaluated.append(index)
        held = {name: float(index % 3 > 0) for name in outcome.outcomes}
        return outcome._replace(outcomes=held, reasons={**outcome.reasons, "reach": "no plan" if index == 4 else ""})

    monkeypatch.setattr(study, "evaluate_setting", evaluate)
    monkeypatch.setattr(study, "DEFAULT_EFFORT", FEW)
    for count in (5, 12):
        run_suite(["robustness"], tmp_path, models=MODELS, seed=0, repeats=count, jobs=1)
    assert evaluated == list(range(12))
    numbers = json.loads((tmp_path / "robustness" / "metrics.json").read_text(encoding="utf-8"))
    assert numbers["settings"] == 12
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
