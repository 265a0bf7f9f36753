"""Protocols that come with the models are sound; spoilt ones end in one line; new ones run as they are."""

import copy
import json

import numpy as np
import pytest
from helpers.answers import answer
from helpers.refusals import refuse
from helpers.results_files import check_names, read_numbers

from affordance.cli import main
from affordance.commands.new_protocol import SCHEMA_FILE, build_schema, write_protocol
from affordance.exceptions import BadValueError
from affordance.experiments.protocol_runs import load_protocol_experiment
from affordance.files.bounded import read_yaml
from affordance.files.data_model import check_content
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.protocols.measured import MeasuredObservers, compute_numbers
from affordance.protocols.number_entries import Measure, NumberEntry
from affordance.protocols.object_entries import build_objects
from affordance.protocols.people import People, describe_people, list_people
from affordance.protocols.people_tables import load_published
from affordance.protocols.protocol import Protocol, find_protocol, list_shipped, load_protocol, refuse_templates

PATH = MODELS / "protocols" / "linear_plus.yaml"


@pytest.mark.parametrize("name", list_shipped())
def test_shipped_protocol_is_sound(name):
    path = find_protocol(name)
    protocol = load_protocol(path)
    objects = build_objects(protocol.objects, path, MODELS)
    assert protocol.name == name
    assert set(protocol.objects.groups) < set(objects.groups)
    assert protocol.report.claims
    assert protocol.report.section == name
    if protocol.published is not None:
        assert "num_people" in load_published(MODELS / protocol.published).values


@pytest.mark.parametrize("mark", ["{{", "{%", "{#"])
def test_every_beginning_of_a_template_is_refused_in_keys_and_deep_down(tmp_path, mark):
    path = tmp_path / "mine.yaml"
    for content in ({"a": [{"b": f"x {mark} y"}]}, {"a": {f"{mark}": 1}}):
        assert "must be plain text" in refuse(refuse_templates, path, content)
    refuse_templates(path, {"a": ["{ {", "100 %}", "}}", "# {"]})


def test_objects_of_the_first_simulation_are_those_of_its_file():
    protocol = load_protocol(find_protocol("weight"))
    objects = build_objects(protocol.objects, find_protocol("weight"), MODELS)
    tools = load_tools(MODELS / "tools" / "weight.yaml")
    assert [tool.name for tool in objects.tools] == [tool.name for tool in tools]
    assert [len(objects.groups[name]) for name in ("honest", "decoy", "all")] == [4, 1, 5]


def test_command_line_refuses_a_spoilt_protocol_in_one_line(tmp_path, capsys):
    path = tmp_path / "mine.yaml"
    text = (
        PATH.read_text(encoding="utf-8").replace("training_60mm", "test").replace("name: linear_plus", "name: mine")
    )
    path.write_text(text, encoding="utf-8")
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.count("\n") == 1
    assert "mine.yaml: objects: has two objects called 'test'" in printed.err
    assert not (tmp_path / "out").exists()


def test_schema_names_what_may_stand_in_a_protocol():
    schema = json.loads(build_schema())
    assert {"name", "objects", "blocks", "numbers", "report"} <= set(schema["properties"])
    group = schema["$defs"]["GroupEntry"]["properties"]
    assert {"from", "to", "names"} == set(group)
    radius = schema["$defs"]["CylinderEntry"]["properties"]["radius"]
    assert (radius["minimum"], radius["maximum"]) == (0.001, 0.5)
    assert "kinds_map" in json.dumps(schema["$defs"]["ObserversEntry"])


def test_new_protocol_is_sound_and_kept(tmp_path):
    path, schema = write_protocol("mine", tmp_path)
    assert schema.name == SCHEMA_FILE
    assert path.read_text(encoding="utf-8").startswith(f"# yaml-language-server: $schema={SCHEMA_FILE}\n")
    assert load_protocol(path).name == "mine"
    path.write_text("precious", encoding="utf-8")
    assert "exists already" in refuse(write_protocol, "mine", tmp_path)
    assert path.read_text(encoding="utf-8") == "precious"
    assert "small letters" in refuse(write_protocol, "Not Fit", tmp_path)
    assert not (tmp_path / "Not Fit.yaml").exists()


def test_new_protocol_predicts_and_runs(tmp_path, capsys):
    """A new protocol is predicted and run with two observers and few lifts, leaving numbers, figure and section."""
    path, _ = write_protocol("mine", tmp_path)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("repetitions: 10", "repetitions: 2").replace("repetitions: 20", "repetitions: 8"))
    assert main(["predict", str(path), "--repeats", "3", "--jobs", "1", "--out", str(tmp_path / "predicted")]) == 0
    printed = capsys.readouterr().out
    assert "density and kinds_map are distinguished best by" in printed
    assert main(["run", str(path), "--repeats", "2", "--jobs", "1", "--out", str(tmp_path / "out")]) == 0
    numbers = read_numbers(tmp_path / "out" / "mine")
    assert set(numbers["learners"]) == {"density", "kinds_map", "kinds_drawn"}
    check_names(load_protocol_experiment(str(path)), None, numbers)
    assert (tmp_path / "out" / "mine" / "odd_one.png").stat().st_size > 10_000
    section = json.loads((tmp_path / "out" / "mine" / "section.json").read_text())
    assert [claim["key"] for claim in section["claims"]] == ["learned"]
    assert section["summary"] == "Do people lift a heavy odd one by its family, or by what it weighs?"
    (table,) = section["tables"]
    assert table["header"] == ["number", "meaning", "of", "value", "95 % interval"]
    assert [row[:3] for row in table["rows"][:2]] == [
        ["first_N", "first lift of the odd one, N", learner]
        for learner in ("one density for each colour", "kinds, most probable")
    ]
    assert len(table["rows"]) == 12


@pytest.mark.usefixtures("unrendered")
def test_words_of_a_report_do_not_throw_observers_away(tmp_path, models):
    path = models / "protocols" / "mine.yaml"
    write_protocol("mine", path.parent)
    text = path.read_text().replace("repetitions: 10", "repetitions: 1").replace("repetitions: 20", "repetitions: 8")
    folder = tmp_path / "out" / "mine" / "repeats"  # a key a learner
    for title, repetitions, keys in (("one", 8, 3), ("another", 8, 3), ("another", 9, 6)):
        path.write_text(text.replace("NAME: an odd", title).replace("repetitions: 8", f"repetitions: {repetitions}"))
        answer("run", "mine", "--repeats", 1, "--jobs", 1, "--models", models, "--out", tmp_path / "out")
        assert len(list(folder.iterdir())) == keys


def make_measured(forces, presented):
    protocol = load_protocol(PATH)
    objects = build_objects(protocol.objects, PATH, MODELS)
    arrays = {Measure.FORCE: forces, Measure.WEIGHT: 9.81 * np.array([t.mass for t in objects.tools])[presented]}
    return protocol, MeasuredObservers(objects, presented, lambda measure, quantile: arrays[measure])


def test_learned_fraction_of_those_who_go_by_the_family_and_by_the_weight():
    """The learned fraction is the share of the way from the family's force to the test object's own weight."""
    rng = np.random.default_rng(0)
    cycles = [rng.permutation(4) for _ in range(30)] + [[4, *rng.permutation(4)] for _ in range(40)]
    presented = np.array([np.concatenate(cycles)] * 3)
    masses = np.array([0.6, 0.75, 1.05, 1.2, np.nan])
    for share in (0.0, 0.4, 1.0):
        forces = 9.81 * masses[presented]
        forces[presented == 4] = 9.81 * (0.9 + share * 0.3)
        protocol, measured = make_measured(forces, presented)
        numbers = compute_numbers(protocol.numbers, measured)
        assert numbers["f"] == pytest.approx(share, abs=1e-9)
        assert numbers["family_N"] == pytest.approx(9.81 * 0.9, rel=1e-9)
        assert numbers["training_correlation"] == pytest.approx(1.0)


def test_numbers_select_group_first_last_growth_and_over():
    presented = np.array([[0, 4, 1, 4], [4, 0, 4, 1]])
    forces = np.array([[1.0, 2.0, 3.0, 6.0], [10.0, 20.0, 30.0, 40.0]])
    _, measured = make_measured(forces, presented)

    def compute(**entry):
        return compute_numbers({"x": NumberEntry.model_validate({"measure": "force", **entry})}, measured)["x"]

    np.testing.assert_array_equal(compute(of="test"), [6.0, 18.0])
    np.testing.assert_array_equal(compute(of="training", over="sum"), [21.0, 43.0])
    np.testing.assert_array_equal(compute(of="test", growth=True), [12.0])
    assert compute(of="test", first=1) == 6.0
    assert compute(of="test", last=1) == 18.0
    assert compute(of="test", single=True, over="median") == 6.0
    assert compute(of="training", over="median of all") == 11.5


def test_errors_of_people_propagate_to_first_order():
    protocol = load_protocol(find_protocol("linear_plus_plus"))
    table = load_published(MODELS / "people" / "linear_plus_plus.csv")
    people = list_people(protocol.numbers, People(table))
    end, family, weight = (people[name].value for name in ("end_N", "family_N", "weight_N"))
    assert people["f"].value == pytest.approx((end - family) / (weight - family))
    # By hand: df = d_end / scale - (1 - f) d_family / scale, half widths of published intervals.
    scale, half = weight - family, 0.5 * np.array([14.74 - 11.56, 10.68 - 8.62])
    expected = np.hypot(half[0], (1.0 - people["f"].value) * half[1]) / scale
    assert 0.5 * (people["f"].high - people["f"].low) == pytest.approx(expected, rel=1e-5)
    assert "weight_N_ci95" not in describe_people(people)


def test_schema_beside_the_shipped_protocols_is_that_of_the_program():
    assert (MODELS / "protocols" / SCHEMA_FILE).read_text(encoding="utf-8") == build_schema()
    for name in list_shipped():
        first = find_protocol(name).read_text(encoding="utf-8").splitlines()[0]
        assert first == f"# yaml-language-server: $schema={SCHEMA_FILE}"


def list_places(content, place=()):
    """Paths of all values of a parsed file."""
    entries = (
        content.items() if isinstance(content, dict) else enumerate(content) if isinstance(content, list) else ()
    )
    for key, value in entries:
        yield (*place, key)
        yield from list_places(value, (*place, key))


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        *(("linear_plus_plus", wrong) for wrong in (None, True, -1, 1e30, float("nan"), "", "x", [], {}, ["x"])),
        *((name, wrong) for name in ("com", "reach") for wrong in (None, -1, {"x": 1})),
    ],
)
def test_protocol_spoilt_anywhere_is_read_or_refused_in_one_line(name, wrong):
    """A protocol spoilt at any place is read, as with another title, or refused in one line of our own error."""
    path = find_protocol(name)
    content = read_yaml(path)
    refusals = []
    for place in list_places(content):
        spoilt = copy.deepcopy(content)
        holder = spoilt
        for part in place[:-1]:
            holder = holder[part]
        holder[place[-1]] = wrong
        try:
            protocol = check_content(path, "", spoilt, Protocol)
            build_objects(protocol.objects, path, MODELS)
        except BadValueError as error:
            refusals.append(str(error))
    assert len(refusals) > 20
    for refusal in refusals:
        assert "\n" not in refusal
        assert "otherwise" not in refusal  # words of pydantic
        assert f"{name}.yaml" in refusal or "cannot be read" in refusal
