"""Files of a run, its section of the report and its warnings, by made-up results; then those of every experiment."""

import dataclasses
import json
import os
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from helpers.results_files import check_keys, read_numbers, read_section
from helpers.shipped_runs import NAMES
from matplotlib.figure import Figure
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from affordance.arrays import about
from affordance.belief.learners import KINDS_MAP
from affordance.exceptions import UnavailableError
from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.results import Results, describe_faults, write_results
from affordance.extensions.pixels.pixel_eye import PIXELS, PixelEye
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.proprioception.faults import NO_FAULTS, Faults
from affordance.reporting.claims import CM, check, claim
from affordance.reporting.report import OWN_MODELS, write_report

DATA = xr.Dataset(
    {
        "height": (("observer", "trial", "time"), np.arange(12.0).reshape(2, 2, 3), about("m", "height of the grip")),
        "chosen": (("observer", "trial"), np.array([[0, 1], [1, -1]]), about("1", "index of the grip")),
        "flips": (("observer", "trial"), np.array([[True, False], [False, True]]), about("1", "whether it flips")),
        "reason": ("observer", ["", "keine Öse"], about("1", "reason of the failure")),
    },
    {"trial": ["rod", "größer"], "time": ("time", [0.0, 0.1, 0.2], about("s", "time since the start"))},
)


def draw():
    figure = Figure()
    figure.subplots().plot([0.0, 1.0])
    return figure


def fail():
    raise UnavailableError("pictures are", "libnothing.so is missing")


def build_diagram():
    builder = DiagramBuilder()
    builder.AddSystem(ConstantVectorSource([1.0])).set_name("source")
    diagram = builder.Build()
    diagram.set_name("made up")
    return diagram


def make(**changes):
    given = Results(
        title="Made up",
        summary="Numbers were drawn.",
        finding="They are small.",
        data=DATA,
        numbers={"mean": 0.25, "list": np.array([1.0, 2.0]), "none": None},
        claims=[claim("small", "ours", "The mean is small.", check("mean", 0.25, CM, at_most=1))],
        figures={"line": ("A line.", draw)},
        tables={"All.": pd.DataFrame({"drop (cm)": ["1.0", "2.0"]}, pd.Index(["rod", "<b>"], name="object"))},
        remarks=["It is made up."],
        lifts=pd.DataFrame({"observer": [0], "force": [1.0 / 3.0], "expected": [np.nan]}),
        diagram=build_diagram,
        replay=lambda path: path.write_text("a replay", encoding="utf-8"),
        files={"note": lambda folder: (folder / "note.txt").write_text("noted", encoding="utf-8")},
        order=7,
    )
    return dataclasses.replace(given, **changes)


def write(out, setup=None, **changes):
    setup = dataclasses.replace(setup or Setup(observers=20), out=out)
    (out / "made_up").mkdir(parents=True, exist_ok=True)
    write_results(make(**changes), "made_up", setup, 0.0)
    return out / "made_up"


def test_everything_is_written_by_its_name_and_numbers_come_last(tmp_path, monkeypatch):
    written = []
    replace = os.replace
    monkeypatch.setattr(
        Path, "replace", lambda self, target: written.append(Path(target).name) or replace(self, target)
    )
    folder = write(tmp_path, Setup(observers=20, seed=3).change(learner=KINDS_MAP, control_period=0.004))
    expected = {"line.png", "line.svg", "data.nc", "lifts.csv", "diagram.dot", "diagram.svg", "replay.html"}
    assert {path.name for path in folder.iterdir()} == {*expected, "note.txt", "section.json", "metrics.json"}
    assert written[-1] == "metrics.json"
    numbers = read_numbers(folder)
    assert (numbers["mean"], numbers["list"], numbers["none"]) == (0.25, [1.0, 2.0], None)
    assert (numbers["seed"], numbers["repeats"], numbers["run_shown"]) == (3, 20, 0)
    assert numbers["config"]["settings"]["control_period"] == 0.004
    assert numbers["config"]["settings"]["noise"]["weber_fraction"] == 0.07
    assert numbers["setup"] == {
        **{"arm": "arm.dmd.yaml", "models": OWN_MODELS, "learners": ["kinds_map"]},
        "settings": {"learner": "kinds_map", "control_period": 0.004},
    }
    assert numbers["versions"].keys() >= {"affordance", "drake", "numpy"}
    assert numbers["wall_s"] > 0.0
    assert (folder / "lifts.csv").read_text(encoding="utf-8") == "observer,force,expected\n0,0.3333333,\n"


def test_learners_of_several_and_an_arm_of_ones_own_are_named(tmp_path, models):
    setup = Setup(observers=20).change(arm=models / "arm.dmd.yaml")
    found = read_numbers(write(tmp_path, setup, learners=["density", "kinds_drawn"]))["setup"]
    assert (found["learners"], found["models"]) == (["density", "kinds_drawn"], "models")


def test_data_are_opened_by_xarray_with_units_and_meanings(tmp_path):
    with xr.open_dataset(write(tmp_path) / "data.nc") as opened:
        found = opened.load()
    assert found.sizes == {"observer": 2, "trial": 2, "time": 3}
    for name in (*DATA, "time"):
        assert found[name].dims == DATA[name].dims
        assert found[name].attrs == DATA[name].attrs
        np.testing.assert_array_equal(found[name].values, DATA[name].values)
    assert found.trial.values.tolist() == ["rod", "größer"]


def test_table_of_lifts_alone_has_no_data_in_netcdf(tmp_path):
    assert not (write(tmp_path, data=pd.DataFrame({"force": [1.0]})) / "data.nc").exists()


def test_section_holds_texts_claims_tables_and_figures(tmp_path):
    section = read_section(write(tmp_path))
    assert (section.order, section.title) == (7, "Made up")
    assert (section.summary, section.finding, section.caution) == ("Numbers were drawn.", "They are small.", "")
    assert section.figures == [
        {"file": "line.png", "caption": "A line."},
        {"file": "diagram.svg", "caption": "Drake Diagram of the simulation, drawn from its connections."},
    ]
    assert section.tables == [
        {"caption": "All.", "header": ["object", "drop (cm)"], "rows": [["rod", "1.0"], ["<b>", "2.0"]]}
    ]
    assert section.remarks == ["It is made up."]
    assert section.claims["small"].met is True
    assert section.claims["small"].criteria[0]["value"] == "25.00 cm"
    assert "<h2>Made up</h2>" in write_report(tmp_path).read_text(encoding="utf-8")


def test_what_is_unavailable_is_left_out_in_one_line_and_the_rest_is_there(tmp_path, caplog):
    folder = write(tmp_path, diagram=fail, figures={"line": ("A line.", draw), "other": ("Another.", fail)})
    assert [message.split(":")[:2] for message in caplog.messages] == [
        ["made_up", " other is left out"],
        ["made_up", " diagram is left out"],
    ]
    assert all("libnothing.so is missing" in message and "\n" not in message for message in caplog.messages)
    assert [figure["file"] for figure in read_section(folder).figures] == ["line.png"]
    assert (folder / "metrics.json").exists()


def test_figures_of_a_former_run_are_not_shown(tmp_path):
    """A figure that this run did not draw is not in its section, even if a former run left it in the folder."""
    folder = write(tmp_path)
    (folder / "seen.png").touch()
    write(tmp_path, figures={"line": ("A line.", fail)}, diagram=None)
    assert (folder / "line.png").exists()
    assert read_section(folder).figures == []


def test_pictures_of_the_camera_are_shown_where_observers_see_by_them(tmp_path, monkeypatch):
    taken = []
    monkeypatch.setattr(PixelEye, "draw", lambda eye, tools, seed: taken.append((len(tools), seed)) or draw())
    tools = load_tools(MODELS / "tools" / "com.yaml")
    assert not (write(tmp_path / "features", seen=tools) / "seen.png").exists()
    pixels = Setup(observers=20, seed=4).change(eye=PIXELS)
    folder = write(tmp_path / "pixels", pixels, seen=tools)
    assert taken == [(3, 4)]
    assert [figure["file"] for figure in read_section(folder).figures] == ["line.png", "seen.png", "diagram.svg"]
    assert read_section(folder).figures[1]["caption"].startswith("Images of each object before it is grasped")


def test_figure_of_the_experiments_own_keeps_its_caption(tmp_path):
    (figure, _) = read_section(write(tmp_path, figures={"seen": ("What was seen.", draw)})).figures
    assert figure == {"file": "seen.png", "caption": "What was seen."}


@pytest.mark.parametrize("observers", [1, 19, 20, 1000])
def test_few_observers_are_warned_of(tmp_path, observers):
    caution = read_section(write(tmp_path, Setup(observers=observers))).caution
    expected = {1: "Only 1 observer: claims need about 20 or more.", 19: "Only 19 observers: claims need about 20"}
    assert caution.startswith(expected.get(observers, ""))
    assert bool(caution) == (observers < 20)


@pytest.mark.parametrize("end", ["", "_test"])
@pytest.mark.parametrize(
    ("outliers", "rejected", "said"),
    [
        ((0, 5), (0, 0), ""),
        ((2, 5), (0, 0), "0 samples were rejected, and 2 trials"),
        ((0, 0), (1, 2), "3 samples were rejected, and 0 trials"),
    ],
)
def test_outliers_are_warned_of_but_for_the_decoy_which_comes_last(tmp_path, caplog, end, outliers, rejected, said):
    write(tmp_path, numbers={f"samples_rejected{end}": rejected, f"trials_outlier{end}": outliers})
    message = f"made_up: {said} with non-decoy objects are 5-sigma outliers"
    assert (message in caplog.text) if said else not caplog.messages


def test_numbers_without_a_list_of_trials_are_not_warned_of(tmp_path, caplog):
    write(tmp_path, numbers={"samples_rejected": 4, "trials_outlier": 2})  # of the experience, which warns itself
    assert not caplog.messages


def test_faults_are_named_by_what_differs_from_none(tmp_path):
    assert describe_faults(NO_FAULTS) == ""
    faults = Faults(stuck_joint="elbow", stuck_torque=-3.0, delay_samples=1)
    said = describe_faults(faults)
    assert said.startswith(
        "Run with faults: stuck_joint elbow, stuck_torque -3.0, delay_samples 1. The true cost of a task"
    )
    assert read_section(write(tmp_path, Setup(observers=20).change(faults=faults))).remarks == [
        "It is made up.",
        said,
    ]


HEADINGS = {
    **{name: (name,) for name in ("weight", "com", "vision")},
    **{name: ("reach and hammer", name) for name in ("reach", "hammer")},
}


@pytest.mark.parametrize("name", HEADINGS)
def test_numbers_are_as_documented(get_shipped, name):
    check_keys(read_numbers(get_shipped(name).folder), *HEADINGS[name])


@pytest.mark.parametrize("name", NAMES)
def test_section_of_an_experiment_is_complete(get_shipped, name):
    """Each claim is judged in digits, no text is left without its number, and rows are as long as the header."""
    found = get_shipped(name)
    section = read_section(found.folder)
    assert section.title
    assert section.summary == found.summary
    assert section.finding == found.finding
    assert [*section.claims] == [claim.key for claim in found.claims]
    for each in section.claims.values():
        assert isinstance(each.met, bool)
        for criterion in each.criteria:
            assert any(character.isdigit() for character in criterion["value"])
            assert criterion["bound"]
    for table in section.tables:
        assert table["rows"]
        assert all(len(row) == len(table["header"]) for row in table["rows"]), table["caption"]
    assert [figure["file"] for figure in section.figures][: len(found.captions)] == [
        f"{file}.png" for file in found.captions
    ]
    for figure in section.figures:
        assert (found.folder / figure["file"]).exists()
    texts = json.dumps([section.summary, section.finding, section.remarks, section.figures, section.tables])
    assert not re.search(r"\bnan\b|[{}]{2}|<function|array\(", texts)
    assert section.caution == "Only 2 observers: claims need about 20 or more."


@pytest.mark.parametrize("name", [name for name in NAMES if name not in ("vision",)])
def test_rows_of_lifts_are_those_of_every_lift(get_shipped, name):
    found = get_shipped(name)
    rows = pd.read_csv(found.folder / "lifts.csv")
    assert len(rows) == len(found.lifts)
    assert (
        rows.groupby(["learner", "observer"])["lift"].apply(lambda lifts: [*lifts] == [*range(1, len(lifts) + 1)])
    ).all()


@pytest.mark.parametrize("name", ["weight", "com", "reach", "hammer", "vision"])
def test_data_of_an_experiment_have_units_and_meanings_in_its_file(get_shipped, name):
    found = get_shipped(name)
    with xr.open_dataset(found.folder / "data.nc") as opened:
        read = opened.load()
    assert set(read.variables) == set(found.data.variables)
    for each, variable in read.variables.items():
        is_label = each in read.coords and variable.dtype.kind in "OSU"
        assert is_label or each in ("quantile", "learner") or set(variable.attrs) >= {"units", "long_name"}, each
        assert variable.dims == found.data[each].dims
        assert variable.shape == found.data[each].shape
        if variable.dtype.kind in "fiu":
            np.testing.assert_array_equal(variable.values, found.data[each].values.astype(variable.dtype))


@pytest.mark.parametrize("name", ["weight", "com", "reach", "hammer"])
def test_simulations_leave_a_diagram_and_a_replay(get_shipped, name):
    folder = get_shipped(name).folder
    assert (folder / "diagram.svg").stat().st_size > 1000
    assert (folder / "replay.html").stat().st_size > 1e6
    assert read_section(folder).figures[-1]["file"] == "diagram.svg"


@pytest.mark.parametrize("name", NAMES)
def test_observers_run_no_code_that_only_reports(get_shipped, name):
    """Code that only reports is not in the key of an observer, so no observer may run it."""
    entered = {
        Path(file).relative_to(MODELS.parent / "affordance").parts[0]
        for file in get_shipped(name).entered
        if Path(file).is_relative_to(MODELS.parent / "affordance")
    }
    assert "experiments" in entered
    assert not entered & {"commands", "reporting"}
