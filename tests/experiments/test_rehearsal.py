"""What a protocol says is tried out when it is read: what cannot be done is one line, before any observer runs."""

import time

import numpy as np
import pytest

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
GRADUAL = "  - {{name: a, repetitions: 2, gradual: {{object: {}, mass_from: 1, mass_to: {}}}, do: {{look: {{}}}}}}\n"
REACH = "  - {name: reach, objects: family, do: {reach: {}}}\n"
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


def claim(value, bound="at_least: 0.5"):
    criteria = f"[{{name: n, value: {value}, {bound}}}]"
    return f"  claims:\n    - {{key: k, source: ours, text: t, criteria: {criteria}}}\n"


@pytest.mark.parametrize(
    ("given", "message"),
    [
        # What is never presented, never changes, or not as often as is asked for.
        (
            {"blocks": GRADUAL.format("lrage", 2)},
            "blocks[0].gradual.object: is 'lrage', must be one of small, large, odd; did you mean 'large'?",
        ),
        (
            {"blocks": "  - {name: a, gradual: {object: odd, mass_from: 1, mass_to: 2}, do: {look: {}}}\n"},
            "blocks[0].gradual.mass_to: is 2 kg in the last repetition, must have at least 2 repetitions",
        ),
        (
            {"blocks": GRADUAL.format("odd", 90)},
            "blocks[0].gradual.mass_to: is 90 kg, which makes a density of 1.57e+05 kg/m^3, must be from",
        ),
        (
            {"blocks": GRADUAL.format("odd", 14)},
            "tools: odd: weighs 14 kg and loads",
        ),
        (
            {"blocks": "  - {name: a, objects: family, first: odd, do: {look: {}}}\n"},
            "blocks[0].first: is 'odd' with 'odd', which is not of 'family' and so would never be presented",
        ),
        ({"blocks": "  - {name: a, measured: false, do: {look: {}}}\n"}, "blocks: has no block that is measured"),
        (
            {"numbers": "  x: {measure: force, of: odd, last: 640}\n"},
            "numbers.x.last: is 640, must be at most 3: so many presentations of 'odd' are measured",
        ),
        (
            {"numbers": "  x: {measure: force, of: odd, growth: true, first: 3}\n"},
            "numbers.x.first: is 3, must be at most 2: so many changes of 'odd' are measured",
        ),
        (
            {"blocks": HOLD, "numbers": "  x: {measure: drop, of: odd, growth: true}\n"},
            "numbers.x.growth: is true, must be false of a single presentation of 'odd'",
        ),
        (
            {"blocks": CLAMP.replace("repet", "objects: family, repet"), "numbers": FORCE},
            "numbers.x.of: is 'odd', of which no presentation is measured so",
        ),
        # What is not measured there.
        (
            {"blocks": LOOK, "numbers": "  x: {measure: drop}\n"},
            "numbers.x.measure: of presentations such as these is 'drop'",
        ),
        ({"blocks": HOLD, "numbers": FORCE}, "numbers.x.measure: of presentations such as these is 'force', must be"),
        ({"blocks": HOLD, "numbers": "  x: {measure: work}\n"}, "is 'work', must be one of weight, founds a kind"),
        ({"blocks": HOLD + LOOK, "numbers": FORCE}, "numbers.x.measure: of presentations such as these is 'force'"),
        (
            {"numbers": "  x: {measure: drop}\n"},
            "of presentations such as these in closed form is 'drop', must be one of force",
        ),
        (
            {"blocks": HOLD + REACH},
            "blocks[1].do: is a reach after a hold in blocks[0], must be like it or not measured",
        ),
        (
            {"blocks": HOLD + "  - {name: b, do: {hold: {duration: 0.2}}}\n"},
            "blocks[1].do: is a hold of another course after a hold in blocks[0], must be like it",
        ),
        (
            {"numbers": "  x: {measure: weight, of: odd, correlated_with: force}\n"},
            "numbers.x.measure: is 'weight', which does not change over these presentations of 'odd', must change",
        ),
        (
            {"numbers": "  x: {measure: force, of: odd, correlated_with: weight}\n"},
            "numbers.x.correlated_with: is 'weight', which does not change over these presentations of 'odd'",
        ),
        (
            {"numbers": "  x: {measure: force, of: odd, predicted_for: family}\n"},
            "numbers.x.of: is 'odd', must be objects of at least two sizes",
        ),
        # Keys that say nothing.
        (
            {"numbers": "  x: {measure: force, quantile: 0.1}\n"},
            "numbers.x.quantile: is given, must not be of the measure",
        ),
        (
            {"numbers": FORCE + "  y: {expression: x, last: 2}\n"},
            "numbers.y.last: is given, must not be of an expression",
        ),
        (
            {"numbers": "  x: {measure: true mass, first: 1}\n"},
            "numbers.x.first: is given, must not be of the measure",
        ),
        (
            {"numbers": "  x: {measure: force, single: true, last: 2}\n"},
            "numbers.x.single: is given, must not be together with 'last'",
        ),
        (
            {"numbers": "  x: {measure: force, growth: true, correlated_with: weight}\n"},
            "numbers.x.growth: is given, must not be together with 'correlated_with'",
        ),
        (
            {"numbers": "  x: {measure: force, correlated_with: believed density}\n"},
            "numbers.x.correlated_with: is 'believed density', must be one of force, weight",
        ),
        (
            {"figures": "  x: {draw: objects, predicted_from: odd}\n"},
            "figures.x.predicted_from: is given, must not be of",
        ),
        # Names.
        (
            {"numbers": FORCE + "  y: {expression: x + z}\n"},
            "numbers.y.expression: names a number that is 'z', must be one of x",
        ),
        (
            {"numbers": "  y: {expression: x}\n" + FORCE},
            "numbers.y.expression: names a number that is 'x', must be one above",
        ),
        ({"numbers": FORCE, "report": claim("y")}, "report.claims[0].criteria[0].value: names a number that is 'y'"),
        ({"numbers": FORCE.replace("x", "seed", 1)}, "numbers.seed: is called as what every run says of itself"),
        ({"numbers": FORCE.replace("x", "repeats", 1)}, "numbers.repeats: is called as what every run says"),
        ({"numbers": FORCE.replace("x", "learners", 1)}, "numbers.learners: is called as what every run says"),
        ({"numbers": FORCE.replace("x", "kappa", 1)}, "numbers.kappa: is called as what every run says of itself"),
        (
            {"blocks": HOLD, "numbers": "  first: {measure: drop}\n"},
            "numbers.first: is called as what every run says",
        ),
        (
            {"numbers": FORCE.replace("}", ", interval: true}") + "  x_ci95: {measure: force}\n"},
            "numbers.x_ci95: is called as the interval of 'x', must be called otherwise",
        ),
        (
            {"name": "weight"},
            "name: is 'weight', must be another: results/weight is of the protocol weight that comes",
        ),
        ({"name": "vision"}, "name: is 'vision', must be another: results/vision is of other results of the program"),
        # What cannot be calculated or compared.
        (
            {"numbers": FORCE + "  y: {expression: 'x[3]'}\n"},
            "numbers.y.expression: the expression 'x[3]' cannot be evaluated",
        ),
        ({"numbers": FORCE + "  y: {expression: \"'heavy'\"}\n"}, "numbers.y.expression: could not convert string"),
        (
            {"numbers": FORCE, "report": claim("\"'heavy'\"")},
            "report.claims[0].criteria[0]: the claim k cannot compare",
        ),
        (
            {"numbers": FORCE, "report": claim("'names[0]'")},
            "report.claims[0].criteria[0]: the claim k cannot compare",
        ),
        (
            {"numbers": "  x: {measure: force, of: odd}\n", "report": claim("'x[9]'")},
            "report.claims[0].criteria[0]: the expression 'x[9]' cannot be evaluated: index 9 is out of bounds",
        ),
        # Figures.
        (
            {"figures": "  x: {draw: heights}\n"},
            "figures.x.draw: of lifts in closed form is 'heights', must be one of lifts",
        ),
        (
            {"blocks": HOLD, "figures": "  x: {draw: lifts}\n"},
            "figures.x.of: is 'all', of which nothing is lifted from a clamp",
        ),
        (
            {"figures": "  x: {draw: lifts}\n", "report": "  figures: [{file: y.png, caption: c}]\n"},
            "report.figures[0].file: is 'y.png', which nothing draws, must be one of x.png; did you mean 'x.png'?",
        ),
        # Observers, groups and files.
        (
            {"more": "observers: {learners: [density, density]}\n"},
            "observers.learners[1]: is 'density', which stands before it",
        ),
        (
            {"more": "observers: {noise: {weber_fraction: 0.07, threshold: 0}}\n"},
            "observers.noise.threshold: is 0, must be from 1e-06 to 10",
        ),
        (
            {"more": "published: people.csv\n"},
            "published: is 'people.csv', which is neither in the protocol's folder nor in",
        ),
        (
            {"more": "people: people.csv\n"},
            "people: is 'people.csv', which is neither in the protocol's folder nor in",
        ),
        (
            {"blocks": "  - {name: a, do: {reach: {path: paths/raech.yaml}}}\n"},
            "blocks[0].do.reach.path: is 'paths/raech.yaml'",
        ),
        ({"more": "novel: {file: tools/novel.yaml}\n"}, "novel: is given, must not be without a block that chooses"),
    ],
)
def test_what_cannot_be_done_is_one_line_before_anything_runs(load, given, message):
    with pytest.raises(BadValueError) as error:
        load(**given)
    assert message in str(error.value)
    assert "mine.yaml" in str(error.value)
    assert "\n" not in str(error.value)


def test_published_row_that_is_no_number_is_refused_with_the_nearest(load, tmp_path):
    header = "quantity,value,low,high,unit,source\nnum_people,9,,,1,us\n"
    (tmp_path / "people.csv").write_text(header + "frist,9,8,10,N,us\n")
    with pytest.raises(BadValueError, match=r"people.csv: quantity: is 'frist', which is no number .* 'first_N'\?"):
        load(numbers=FORCE.replace("x", "first_N", 1), more="published: people.csv")
    (tmp_path / "people.csv").write_text(header.replace("9", "1") + "first_N,9,8,10,N,us\n")
    with pytest.raises(BadValueError, match=r"people.csv: num_people, value: is 1, must be at least 2"):
        load(numbers=FORCE.replace("x", "first_N", 1), more="published: people.csv")


def test_groups_that_are_empty_are_refused(load):
    with pytest.raises(BadValueError, match=r"groups.none: is empty: from 3 to 2 of 3 objects there is none"):
        load(more="    none: {from: 3, to: 2}\n")


def test_choices_have_no_numbers_of_their_own(tmp_path):
    text = (load_protocol_experiment("reach").section).read_text(encoding="utf-8")
    path = tmp_path / "mine.yaml"
    for more, key in (("numbers: {x: {measure: drop}}", "numbers"), ("figures: {x: {draw: objects}}", "figures")):
        path.write_text(text.replace("name: reach\n", f"name: mine\n{more}\n"), encoding="utf-8")
        with pytest.raises(BadValueError, match=rf"mine.yaml: {key}: is given, must not be of choices"):
            load_protocol_experiment(str(path))


def test_own_protocol_does_not_take_the_folder_of_a_shipped_one(tmp_path, capsys):
    text = load_protocol_experiment("weight").section.read_text(encoding="utf-8")
    (tmp_path / "mine.yaml").write_text(text, encoding="utf-8")
    assert main(["run", str(tmp_path / "mine.yaml"), "--out", str(tmp_path / "out")]) == 2
    assert "mine.yaml: name: is 'weight', must be another" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    assert main(["new-protocol", "weight", "--folder", str(tmp_path)]) == 2
    assert not (tmp_path / "weight.yaml").exists()


def test_options_that_lifts_in_closed_form_do_not_know_are_refused(capsys, tmp_path):
    for options, message in (
        (["--vision", "pixels"], "--vision: is 'pixels'"),
        (["--fault", "bias"], "--fault: is given"),
    ):
        assert main(["run", "linear_plus", *options, "--out", str(tmp_path / "out")]) == 2
        assert message in capsys.readouterr().err


def test_what_is_refused_elsewhere_is_honoured_where_it_can_be(load):
    """Objects are drawn in closed form, and beliefs are measured there."""
    numbers = (
        "  x: {measure: believed density, quantile: 0.1}\n  y: {measure: expected mass}\n  z: {measure: outlier}\n"
    )
    experiment = load(
        numbers=numbers, figures="  them: {draw: objects}\n", report="  figures: [{file: them.png, caption: c}]\n"
    )
    arrays = {name: np.stack([array] * 2) for name, array in experiment.run_observer(None, None, 0).items()}
    found = experiment.compute_metrics(None, None, arrays)
    assert found["x"].shape == (10,)
    assert found["x"][0] < found["x"][9]
    assert found["y"].shape == (9,)
    assert experiment.show(None, None, arrays, found).figures["them"]().get_axes()


def test_looks_between_holds_leave_their_numbers_and_files_alone(load, tmp_path):
    numbers = "  x: {measure: drop, of: odd, single: true}\n  y: {measure: expected mass, of: odd}\n"
    figures = "  heights: {draw: heights}\n"
    experiment = load(blocks=LOOK + HOLD, numbers=numbers, figures=figures)
    arrays = {name: np.stack([array] * 2) for name, array in experiment.run_observer(None, None, 0).items()}
    found = experiment.compute_metrics(None, None, arrays)
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
    arrays = {name: np.stack([row[name] for row in rows]) for name in rows[0]}
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
    """Three materials of two colours; the group has one of each."""
    experiment = load(
        blocks=HOLD,
        numbers="  x: {measure: believed densities, of: pair}\n",
        figures="  heights: {draw: heights, of: family}\n",
        more="    pair: {names: [small, odd]}\nobservers: {learners: [density]}\n",
    )
    path = tmp_path / "mine.yaml"
    path.write_text(path.read_text().replace('mass: 1.4, colour: "#8c8c8c"', 'mass: 1.4, colour: "#aa2211"'))
    experiment = load_protocol_experiment(str(path))
    arrays = {name: np.stack([array] * 2) for name, array in experiment.run_observer(None, None, 0).items()}
    found = experiment.compute_metrics(None, None, arrays)
    assert set(found["x"]) == {"small", "odd"}
    assert arrays["densities"].shape == (2, 3, 2)
    assert experiment.show(None, None, arrays, found).figures["heights"]()  # of two objects only
