"""lifts.csv has a row for each presentation, true to the simulation, and people's rows are read likewise."""

import csv
import json

import numpy as np
import pytest
from helpers.changed_files import change_file
from helpers.results_files import read_numbers
from helpers.short_holds import shorten
from helpers.stacked import stack

from affordance.cli import main
from affordance.commands.new_protocol import write_protocol
from affordance.exceptions import BadValueError
from affordance.experiments.protocol_runs import load_hold_experiment, load_protocol_experiment
from affordance.experiments.runner import run_experiment
from affordance.experiments.shared.presentation_rows import compute_surprise
from affordance.protocols.people_tables import COLUMNS

HEADER = "observer,lift,object,force\n"


def read(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture
def short(tmp_path):
    path, _ = write_protocol("mine", tmp_path)
    text = path.read_text(encoding="utf-8")
    text = text.replace("repetitions: 10", "repetitions: 2").replace("repetitions: 20", "repetitions: 8")
    path.write_text(text.replace("number: 50", "number: 3"), encoding="utf-8")
    return path


def run(path, tmp_path, *more):
    assert main(["run", str(path), "--jobs", "1", "--out", str(tmp_path / "out"), *more]) == 0
    return tmp_path / "out" / "mine"


@pytest.mark.usefixtures("unrendered")
def test_every_lift_of_every_observer_of_every_learner_is_a_row(short, tmp_path):
    rows = read(run(short, tmp_path) / "lifts.csv")
    assert tuple(rows[0]) == COLUMNS
    assert len(rows) == 3 * 3 * (2 * 2 + 8 * 3)
    first, *_ = of_one = [row for row in rows if row["learner"] == "kinds_map" and row["observer"] == "1"]
    assert [int(row["lift"]) for row in of_one] == list(range(1, 29))
    assert [row["cycle"] for row in of_one[:4]] == ["1", "1", "2", "2"]
    assert {row["block"] for row in of_one[4:]} == {"odd one among them"}
    odd = [row for row in of_one if row["object"] == "odd"]
    assert {row["mass"] for row in odd} == {"1.4"}
    assert float(odd[0]["size"]) == pytest.approx(np.pi * 0.045**2 * 0.09, rel=1e-6)
    for row in of_one:
        assert float(row["force"]) == pytest.approx(9.81 * float(row["expected"]), rel=1e-5)
        assert float(row["surprise"]) >= 0.0
    assert float(first["believed_density"]) == 1000.0  # the prior's mode, before anything was lifted
    assert odd[0]["kind"] in ("1", "2")
    assert {row["kind"] for row in rows if row["learner"] == "density"} == {""}
    metrics = read_numbers(tmp_path / "out" / "mine")
    ends = [
        [
            float(row["force"])
            for row in rows
            if row["object"] == "odd" and row["learner"] == "kinds_map" and row["observer"] == str(k)
        ][-8:]
        for k in range(3)
    ]
    assert metrics["learners"]["kinds_map"]["end_N"] == pytest.approx(np.mean(ends), rel=1e-6)


@pytest.mark.usefixtures("unrendered")
def test_rows_of_simulated_presentations_and_of_what_came_before_them(tmp_path):
    """Simulation II has two rows of shared holds in which observers learn, then three in which they do not."""
    experiment = shorten(load_hold_experiment("com"), 0.3, repetitions=1)
    run_experiment(experiment, None, tmp_path / "com", repeats=2, jobs=1)
    rows = read(tmp_path / "com" / "lifts.csv")
    assert len(rows) == 2 * (2 + 3)
    assert [row["block"] for row in rows[:5]] == ["learning"] * 2 + ["test"] * 3
    assert [row["lift"] for row in rows[:5]] == ["1", "2", "3", "4", "5"]
    assert {row["force"] for row in rows} == {""}
    numbers = read_numbers(tmp_path / "com")
    of_test = [row for row in rows if row["block"] == "test"]
    errors = [
        abs(float(row["expected"]) / float(row["mass"]) - 1.0)
        for row in of_test
        if row["object"] != of_test[2]["object"]
    ]
    assert numbers["mass_error"] == pytest.approx(np.median(errors), rel=1e-4)
    surprises = np.array([float(row["surprise"]) for row in of_test]).reshape(2, 3)
    assert (surprises.argmax(axis=1) == 2).all()  # the decoy


def test_surprise_is_a_logarithm_that_ends():
    assert compute_surprise(1e-7) == pytest.approx(7.0)
    assert compute_surprise(0.0) == 300.0
    assert np.isnan(compute_surprise(np.nan))


def test_what_a_run_writes_can_be_read_as_what_people_did(short, tmp_path):
    """Rows of three observers of one learner, read as people's, give the numbers of that learner."""
    folder = run(short, tmp_path)
    lines = (folder / "lifts.csv").read_text().splitlines()
    own = [lines[0], *(line for line in lines if ",kinds_map," in line)]
    (tmp_path / "people.csv").write_text("\n".join(own) + "\n")
    change_file(short, "# people: mine_people.csv", "people: people.csv")
    numbers = read_numbers(run(short, tmp_path))
    ours, people = numbers["learners"]["kinds_map"], numbers["people"]
    assert set(people) >= {"first_N", "end_N", "weight_N", "learned", "end_N_ci95"}
    for name in ("first_N", "end_N", "learned", "end_N_ci95"):
        np.testing.assert_allclose(people[name], ours[name], rtol=1e-5)
    assert (folder / "odd_one.png").stat().st_size > 10_000
    assert main(["predict", str(short), "--jobs", "1", "--out", str(tmp_path / "out")]) == 0
    found = json.loads((folder / "predictions.json").read_text())
    assert found["spread_between_people"]["first_N"]["sd"] == pytest.approx(
        found["numbers"]["first_N"]["kinds_map"]["sd"], rel=1e-4
    )


def test_people_are_drawn_behind_the_observers(short, tmp_path):
    text = HEADER + "".join(f"{who},{lift},odd,{9 + who + 0.1 * lift}\n" for who in range(4) for lift in range(8))
    (tmp_path / "people.csv").write_text(text)
    change_file(short, "# people: mine_people.csv", "people: people.csv")
    experiment = load_protocol_experiment(str(short))
    rows = [experiment.run_observer(None, None, repeat) for repeat in range(2)]
    arrays = stack(rows)
    numbers = experiment.compute_metrics(None, None, arrays)
    assert numbers["people"]["end_N"] == pytest.approx(9.0 + 1.5 + 0.35)
    figure = experiment.show(None, None, arrays, numbers).figures["odd_one"]()
    (mean,) = [line for line in figure.axes[0].lines if str(line.get_label()).startswith("4 people")]
    np.testing.assert_allclose(mean.get_ydata(), 10.5 + 0.1 * np.arange(8))
    assert mean.get_zorder() < min(line.get_zorder() for line in figure.axes[0].lines if line.get_linewidth() == 2.2)


def test_people_who_lifted_less_often_than_a_number_asks_for_are_named(short, tmp_path):
    (tmp_path / "people.csv").write_text(HEADER + "anna,1,odd,9\nanna,2,odd,9\n")
    change_file(short, "# people: mine_people.csv", "people: people.csv")
    with pytest.raises(BadValueError, match=r"has 2 lifts of 'odd' by 'anna', must have 8 for the number end_N"):
        load_protocol_experiment(str(short))
