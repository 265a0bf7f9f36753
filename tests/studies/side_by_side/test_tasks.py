"""Choices for both tasks, side by side."""

import json

import numpy as np
import pytest
from helpers.answers import answer
from helpers.results_files import OF_STUDY, read_numbers

from affordance.choice.picking import NO_OPTION
from affordance.experiments.shared.decisions import label_choices
from affordance.files.netcdf import Trajectories, write_trajectories
from studies.side_by_side.tasks import NAME, ToolChoices, compute_agreement

REACH = [[[0, 1], [0, 1]], [[1, 1], [1, 1]], [[0, 1], [NO_OPTION, 1]]]
# Grips for the stick always differ from those for reaching; for the hammer all but one are the same.
HAMMER = [[[1, 0], [0, 1]], [[0, 0], [1, 1]], [[1, 0], [1, 1]]]


def save(out, task, chosen, correct, *, seed=0, tools=("stick", "hammer"), inputs="as read"):
    """A finished run as far as it is read: chosen grips by index (observers, tools, moments), and the correct one."""
    folder = out / task
    folder.mkdir(exist_ok=True)
    numbers = {
        "tools": {
            name: {"energy_true": {"wood": 1, "steel": 2}, "correct_grip": correct, "chance_by_symmetry": k == 0}
            for k, name in enumerate(("stick", "hammer"))
        },
        "repeats": len(chosen),
        "seed": seed,
        "inputs": inputs,
        "config": {"experience": {"seed": seed, "settings": {"faults": {"bias_sd": 0.0}}}, "novel": ["as read"]},
    }
    (folder / "metrics.json").write_text(json.dumps(numbers), encoding="utf-8")
    chosen = np.array(chosen)
    labelled = label_choices({"paper": chosen, "bayes": chosen[:, 0]})
    write_trajectories(folder / "trajectories.nc", Trajectories(labelled, {"tool": tools}))


def save_both(out, hammer=HAMMER, **changes):
    save(out, "reach", REACH, "steel")
    save(out, "hammer", hammer, "wood", **changes)


def compare(out, status=0):
    return answer("study", "side_by_side", "--out", out, status=status).err


def test_agreement_is_counted_observer_by_observer(tmp_path):
    save_both(tmp_path)
    compare(tmp_path)
    numbers = read_numbers(tmp_path / NAME)
    assert numbers.keys() - OF_STUDY == {"tools", "repeats", "seed"}
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
        assert ((low <= hammer[name]) & (hammer[name] <= high) & (low < high)).all()


def test_section_says_where_two_experiments_show_one_result(tmp_path):
    save_both(tmp_path)
    compare(tmp_path)
    section = json.loads((tmp_path / NAME / "section.json").read_text())
    assert [row[0] for row in section["tables"][0]["rows"]] == ["stick (symmetric)", "hammer"]
    assert all(len(row) == len(section["tables"][0]["header"]) for row in section["tables"][0]["rows"])
    assert "Of the stick both choices were right or wrong together in 100.0 % of all cases" in section["remarks"][0]
    assert "one result or two" in (tmp_path / "report.html").read_text(encoding="utf-8")
    # Once the choices about the stick part, it is not said any more.
    save_both(tmp_path, [[[1, 0], [0, 1]], [[0, 0], [1, 1]], [[1, 1], [1, 1]]])
    compare(tmp_path)
    assert json.loads((tmp_path / NAME / "section.json").read_text())["remarks"] == []


def test_nothing_is_compared_where_there_is_one_task(tmp_path):
    save(tmp_path, "reach", REACH, "wood")
    assert "must hold both reach and hammer, or give --pixels" in compare(tmp_path, status=2)
    assert not (tmp_path / NAME).exists()


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"seed": 1}, "experience.seed: is 1, must be 0 as in"),
        ({"inputs": "others"}, "inputs: is 'others', must be 'as read' as in"),
        ({"hammer": HAMMER[:2]}, "repeats: is 2, must be 3 as in"),
        ({"tools": ("stick", "axe")}, "tool: is stick, axe, must be stick, hammer"),
    ],
)
def test_runs_that_differ_are_not_compared(tmp_path, changes, problem):
    save_both(tmp_path, **changes)
    assert problem in compare(tmp_path, status=2)
    assert not (tmp_path / NAME).exists()


@pytest.mark.parametrize("name", ["metrics.json", "trajectories.nc"])
@pytest.mark.parametrize("text", ["", "[1]", "null", '{"config": {}}', "[" * 100_000])
def test_file_that_no_experiment_wrote_is_named(tmp_path, name, text):
    save_both(tmp_path)
    (tmp_path / "hammer" / name).write_text(text)
    error = compare(tmp_path, status=2)
    assert error.count("\n") == 1
    assert f"hammer/{name}" in error
    assert not (tmp_path / NAME).exists()


def test_independent_choices_agree_as_often_as_chance_has_it():
    rng = np.random.default_rng(0)
    one, other = ((rng.random((20_000, 1)) < share).astype(int) for share in (0.7, 0.6))
    agreed = compute_agreement(ToolChoices(False, 1, one), ToolChoices(False, 1, other))
    assert agreed["both_right_or_wrong"][0] == pytest.approx(0.7 * 0.6 + 0.3 * 0.4, abs=0.015)
