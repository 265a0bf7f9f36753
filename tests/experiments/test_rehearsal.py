"""Protocols are tried out when they are read: one line says what cannot be done, before any observer runs."""

import time

import numpy as np
import pytest
from helpers.stacked import stack

from affordance.cli import main
from affordance.exceptions import BadValueError
from affordance.experiments.protocol_runs import load_protocol_experiment
from affordance.protocols.protocol import list_shipped

PROTOCOL = """
name: {name}
question: What is expected?
objects:
  cylinders:
    - {{name: small, radius: 0.045, height: 0.06, mass: 0.6, colour: "#8c8c8c"}}
    - {{name: large, radius: 0.045, height: 0.12, mass: 1.2, colour: "#8c8c8c"}}
    - {{name: odd, radius: 0.045, height: 0.09, mass: 1.4, colour: "#8c8c8c"}}
  groups:
    family: {{names: [small, large]}}
    odd: {{names: [odd]}}
{more}
blocks:
{blocks}
numbers:
{numbers}
figures:
{figures}
report:
  title: Mine
{report}
"""
CLAMP = "  - {name: a, repetitions: 3, do: {clamp: {closed_form: true}}}\n"
HOLD = "  - {name: a, do: {hold: {duration: 0.1}}}\n"
LOOK = "  - {name: look, do: {look: {}}}\n"
FORCE = "  x: {measure: force, of: odd, first: 1}\n"


@pytest.fixture
def load(tmp_path):
    def load(blocks=CLAMP, numbers="  {}", figures="  {}", report="", more="", name="mine"):
        path = tmp_path / "mine.yaml"
        content = PROTOCOL.format(
            blocks=blocks, numbers=numbers, figures=figures, report=report, more=more, name=name
        )
        path.write_text(content, encoding="utf-8")
        return load_protocol_experiment(str(path))

    return load


def measure(experiment):
    """Arrays of two observers who are the same, and the numbers."""
    arrays = stack([experiment.run_observer(None, None, 0)] * 2)
    return arrays, experiment.compute_metrics(None, None, arrays)


def test_published_row_that_is_no_number_is_refused_with_the_nearest(load, tmp_path):
    header = "quantity,value,low,high,unit,source\nnum_people,9,,,1,us\n"
    (tmp_path / "people.csv").write_text(header + "frist,9,8,10,N,us\n")
    with pytest.raises(BadValueError, match=r"people.csv: quantity: is 'frist', .* not a number .* 'first_N'\?"):
        load(numbers=FORCE.replace("x", "first_N", 1), more="published: people.csv")
    (tmp_path / "people.csv").write_text(header.replace("9", "1") + "first_N,9,8,10,N,us\n")
    with pytest.raises(BadValueError, match=r"people.csv: num_people, value: is 1, must be at least 2"):
        load(numbers=FORCE.replace("x", "first_N", 1), more="published: people.csv")


def test_own_protocol_does_not_take_the_folder_of_a_shipped_one(tmp_path, capsys):
    text = load_protocol_experiment("weight").section.read_text(encoding="utf-8")
    (tmp_path / "mine.yaml").write_text(text, encoding="utf-8")
    assert main(["run", str(tmp_path / "mine.yaml"), "--out", str(tmp_path / "out")]) == 2
    assert "mine.yaml: name: is 'weight', must be another" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    assert main(["new-protocol", "weight", "--folder", str(tmp_path)]) == 2
    assert not (tmp_path / "weight.yaml").exists()


def test_what_is_refused_elsewhere_is_honoured_where_it_can_be(load):
    """Closed form draws objects and measures beliefs, which are refused for other means."""
    numbers = (
        "  x: {measure: believed density, quantile: 0.1}\n  y: {measure: expected mass}\n  z: {measure: outlier}\n"
    )
    experiment = load(
        numbers=numbers, figures="  them: {draw: objects}\n", report="  figures: [{file: them.png, caption: c}]\n"
    )
    arrays, found = measure(experiment)
    assert found["x"].shape == (10,)
    assert found["x"][0] < found["x"][9]
    assert found["y"].shape == (9,)
    assert experiment.show(None, None, arrays, found).figures["them"]().get_axes()


def test_looks_between_holds_leave_their_numbers_and_files_alone(load, tmp_path):
    numbers = "  x: {measure: drop, of: odd, single: true}\n  y: {measure: expected mass, of: odd}\n"
    figures = "  heights: {draw: heights}\n"
    experiment = load(blocks=LOOK + HOLD, numbers=numbers, figures=figures)
    arrays, found = measure(experiment)
    assert np.isfinite(found["x"])
    assert found["y"].shape == (2,)
    outputs = experiment.show(None, None, arrays, found)
    assert outputs.figures["heights"]()
    assert outputs.trajectories.variables["q"].values.shape[0] == 6
    assert np.isnan(outputs.trajectories.variables["q"].values[:3]).all()


def test_expressions_act_on_each_observer_along_presentations(load):
    numbers = (
        "  x: {measure: force, of: odd}\n  d: {expression: diff(x)}\n  m: {expression: mean(x), interval: true}\n"
        "  t: {measure: true mass, of: odd, single: true}\n  r: {expression: x / t}\n"
    )
    experiment = load(numbers=numbers)
    rows = [experiment.run_observer(None, None, repeat) for repeat in range(3)]
    arrays = stack(rows)
    found = experiment.compute_metrics(None, None, arrays)
    x = np.array([row["force"][row["presented"] == 2] for row in rows])
    np.testing.assert_allclose(found["d"], np.diff(x, axis=1).mean(axis=0))
    assert found["m"] == pytest.approx(x.mean())
    half = 4.303 * x.mean(axis=1).std(ddof=1) / np.sqrt(3.0)  # Student's, 2 degrees of freedom
    np.testing.assert_allclose(found["m_ci95"], x.mean() + np.array([-half, half]), rtol=1e-3)
    np.testing.assert_allclose(found["r"], x.mean(axis=0) / 1.4)


@pytest.mark.parametrize("name", list_shipped())
def test_shipped_protocols_are_loaded_and_tried_out_fast(name):
    load_protocol_experiment(name)
    start = time.process_time()
    load_protocol_experiment(name)
    assert time.process_time() - start < 2.0  # a guard: it takes a tenth of a second


def test_believed_densities_are_those_of_the_colours_of_a_group(load, tmp_path):
    """A group of two of three materials, with one of each colour, has two believed densities."""
    experiment = load(
        blocks=HOLD,
        numbers="  x: {measure: believed densities, of: pair}\n",
        figures="  heights: {draw: heights, of: family}\n",
        more="    pair: {names: [small, odd]}\nobservers: {learners: [density]}\n",
    )
    path = tmp_path / "mine.yaml"
    path.write_text(path.read_text().replace('mass: 1.4, colour: "#8c8c8c"', 'mass: 1.4, colour: "#aa2211"'))
    experiment = load_protocol_experiment(str(path))
    arrays, found = measure(experiment)
    assert set(found["x"]) == {"small", "odd"}
    assert arrays["densities"].shape == (2, 3, 2)
    assert experiment.show(None, None, arrays, found).figures["heights"]()  # the group has two objects
