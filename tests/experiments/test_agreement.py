"""Choices for both tasks, side by side."""

import dataclasses
import json
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.two_tools import HAMMER, STICK

from affordance.choice.ranking import NO_OPTION
from affordance.experiments.agreement import NAME, ToolChoices, compare_tasks, compute_agreement, save_choices
from affordance.reporting.report import write_report
from affordance.settings import DEFAULT_SETTINGS

CHOICES = {
    tool.name: SimpleNamespace(options=[SimpleNamespace(grip=grip.name) for grip in tool.grips])
    for tool in (STICK, HAMMER)
}


def save(out, task, chosen, correct, *, settings=DEFAULT_SETTINGS, seed=0):
    """What observers chose, indices of grips (observers, tools, moments), with the correct grips."""
    numbers = {"tools": {name: {"correct_grip": grip} for name, grip in correct.items()}}
    save_choices(
        out / task,
        novel=(STICK, HAMMER),
        choices=CHOICES,
        chosen=np.array(chosen),
        numbers=numbers,
        settings=settings,
        seed=seed,
    )


REACH = [[[0, 1], [0, 1]], [[1, 1], [1, 1]], [[0, 1], [NO_OPTION, 1]]]
OPPOSITE = {"stick": "wood", "hammer": "wood"}


def save_both(out, **changes):
    save(out, "reach", REACH, {"stick": "steel", "hammer": "steel"})
    # Of the stick always the other grip, of the hammer the same but once.
    save(out, "hammer", [[[1, 0], [0, 1]], [[0, 0], [1, 1]], [[1, 0], [1, 1]]], OPPOSITE, **changes)


def test_agreement_is_counted_observer_by_observer(tmp_path):
    save_both(tmp_path)
    compare_tasks(tmp_path)
    numbers = json.loads((tmp_path / NAME / "metrics.json").read_text())
    stick, hammer = numbers["tools"]["stick"], numbers["tools"]["hammer"]
    assert (stick["symmetric"], hammer["symmetric"]) == (True, False)
    assert stick["same_grip"] == [0.0, 0.0]
    assert stick["both_right_or_wrong"] == [1.0, 1.0]
    assert (stick["agreement"], hammer["agreement"]) == (1.0, pytest.approx(1 / 6))
    assert stick["both_correct"] == pytest.approx([1 / 3, 1.0])
    assert hammer["same_grip"] == pytest.approx([2 / 3, 1.0])
    # Before: wood, steel and nothing for reaching by steel; wood, steel and steel for hammering by wood.
    assert hammer["both_right_or_wrong"] == pytest.approx([1 / 3, 0.0])
    assert hammer["only_reach"] == pytest.approx([1 / 3, 1.0])
    assert hammer["only_hammer"] == pytest.approx([1 / 3, 0.0])
    for name in ("same_grip", "both_correct"):
        low, high = np.array(hammer[f"{name}_ci95"]).T
        assert (low <= hammer[name]).all()
        assert (hammer[name] <= high).all()
        assert (low < high).all()


def test_section_says_where_two_experiments_show_one_result(tmp_path):
    save_both(tmp_path)
    compare_tasks(tmp_path)
    section = json.loads((tmp_path / NAME / "section.json").read_text())
    assert [row[0] for row in section["tables"][0]["rows"]] == ["stick (symmetric)", "hammer"]
    assert all(len(row) == len(section["tables"][0]["header"]) for row in section["tables"][0]["rows"])
    assert "Of the stick both choices were right or wrong together in 100.0 % of all cases" in section["remarks"][0]
    assert "one result or two" in write_report(tmp_path).read_text(encoding="utf-8")
    # Once the choices about the stick part, it is not said any more.
    save(tmp_path, "hammer", [[[1, 0], [0, 1]], [[0, 0], [1, 1]], [[1, 1], [1, 1]]], OPPOSITE)
    compare_tasks(tmp_path)
    assert json.loads((tmp_path / NAME / "section.json").read_text())["remarks"] == []


def test_nothing_is_compared_where_there_is_one_task(tmp_path):
    save(tmp_path, "reach", REACH, OPPOSITE)
    compare_tasks(tmp_path)
    assert not (tmp_path / NAME).exists()


@pytest.mark.parametrize(
    ("changes", "apart"),
    [
        ({"seed": 1}, "seed"),
        (
            {
                "settings": dataclasses.replace(
                    DEFAULT_SETTINGS, faults=dataclasses.replace(DEFAULT_SETTINGS.faults, bias_sd=3.0)
                )
            },
            "faults",
        ),
    ],
)
def test_runs_that_differ_are_not_compared(tmp_path, caplog, changes, apart):
    save_both(tmp_path)
    compare_tasks(tmp_path)
    save_both(tmp_path, **changes)
    compare_tasks(tmp_path)
    assert not (tmp_path / NAME / "section.json").exists()  # what it said no longer holds
    assert caplog.text.rstrip().endswith(f"not compared, as they differ in {apart}")


@pytest.mark.parametrize("text", ["", "[1]", "null", '{"shared": {}}', "[" * 100_000])
def test_file_that_no_experiment_wrote_is_named_and_set_aside(tmp_path, caplog, text):
    save_both(tmp_path)
    path = tmp_path / "hammer" / "choices.json"
    path.write_text(text)
    compare_tasks(tmp_path)
    assert "choices.json is not what an experiment found (" in caplog.text
    assert path.with_suffix(".broken").exists()
    assert not (tmp_path / NAME).exists()


def test_independent_choices_agree_as_often_as_chance_has_it():
    rng = np.random.default_rng(0)
    one, other = (np.where(rng.random((20_000, 1)) < share, "wood", "steel") for share in (0.7, 0.6))
    agreed = compute_agreement(ToolChoices(False, "wood", one), ToolChoices(False, "wood", other))
    assert agreed["both_right_or_wrong"][0] == pytest.approx(0.7 * 0.6 + 0.3 * 0.4, abs=0.015)
