"""Spoilt files: files of models in generated ways, a lasting corpus, and files of results."""

import logging

import numpy as np
import pytest
from helpers.spoilt_models import (
    ARM,
    ARM_FILES,
    FILES,
    Answer,
    Case,
    answer,
    copy_models,
    names_the_place,
    spoil,
)
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from affordance.files.model_folder import MODELS
from affordance.reporting.claims import ClaimResult, CriterionResult
from affordance.reporting.report import write_report, write_section
from affordance.reporting.section import Section
from affordance.runs.repeats import run_repeats

QUICKLY = settings(
    max_examples=80,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


@pytest.fixture(scope="module")
def models():
    with copy_models() as folder:
        yield folder


@settings(QUICKLY, max_examples=40)
@given(spoil())
def test_file_spoilt_anywhere_is_refused_by_file_and_key(models, case):
    found = answer(models, case)
    assert found.refused, (case, found)
    assert names_the_place(case, found), (case, found)


@pytest.mark.parametrize(
    ("keys", "said", "named"),
    [
        (("mass",), "run.py: tools/com.yaml: tools[0].mass: is -1, must be more than 0", True),
        (("mass",), "run.py: tools/com.yaml: tools[0].bodymass: is -1, must be more than 0", False),
        (("mass",), "run.py: tools/com.yaml: tools[0].size: is -1, must be a mass", False),
        (("mass",), "run.py: mass.yaml: tools: is -1, must be more than 0", False),
        (("shape",), "run.py: tools/com.yaml: tools: ball.shape: is 3", True),
        (("other", "mass"), "run.py: tools/com.yaml: mass: is missing", True),
        ((), "run.py: tools/com.yaml: is not YAML", True),
        ((), "run.py: com: is not YAML", False),
    ],
)
def test_place_is_named_as_an_element_of_the_path(keys, said, named):
    found = Answer(2, "", f"{said}\n", False)
    assert names_the_place(Case("tools/com.yaml", b"", "", keys), found) is named


@pytest.mark.parametrize("number", range(len(ARM)))
def test_spoilt_arm_is_refused(models, monkeypatch, number):
    name, good, bad = ARM[number]
    text = (MODELS / name).read_text(encoding="utf-8")
    assert good in text
    monkeypatch.setitem(FILES, name, "weight")
    found = answer(models, Case(name, text.replace(good, bad, 1).encode(), bad))
    assert found.refused, found
    assert ARM_FILES.search(found.err)


def draw(repeat):
    return {"drawn": np.random.default_rng(repeat).normal(size=(2, 3)), "count": np.array(repeat)}


def draw_zeros(repeat):
    return {"drawn": np.zeros((2, 3)), "count": np.array(0)}


def run(folder):
    return run_repeats(folder, draw, repeats=2, jobs=1, description="test")


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A folder of repeats, the content of the file of the second, and the numbers of both."""
    folder = tmp_path_factory.mktemp("repeats")
    good = run(folder)
    return folder, (folder / "repeat_00001.npz").read_bytes(), good


@QUICKLY
@given(data=st.data())
def test_damaged_repeat_is_never_trusted(kept, data):
    """Numbers are those of an undamaged repeat, whether a kept one is cut, flipped, extended or replaced."""
    folder, undamaged, good = kept
    path = folder / "repeat_00001.npz"
    content = bytearray(undamaged)
    way = data.draw(st.sampled_from(["cut", "flip", "insert", "random", "empty"]))
    place = data.draw(st.integers(0, len(content) - 1))
    if way == "cut":
        del content[place:]
    elif way == "flip":
        content[place] ^= 1 << data.draw(st.integers(0, 7))
    elif way == "insert":
        content[place:place] = data.draw(st.binary(min_size=1, max_size=20))
    else:
        content = bytearray(data.draw(st.binary(max_size=200)) if way == "random" else b"")
    path.write_bytes(content)
    again = run(folder)
    assert set(again) == set(good)
    for name, values in good.items():
        np.testing.assert_array_equal(values, again[name])


def test_repeat_of_another_run_is_named_and_set_aside(tmp_path, caplog):
    ours, theirs = tmp_path / "ours", tmp_path / "theirs"
    good = run(ours)
    run_repeats(theirs, draw_zeros, repeats=2, jobs=1, description="test")
    (theirs / "repeat_00001.npz").replace(ours / "repeat_00001.npz")
    (ours / "repeat_00000.npz").write_bytes((ours / "repeat_00001.npz").read_bytes())
    with caplog.at_level(logging.WARNING):
        again = run(ours)
    np.testing.assert_array_equal(good["drawn"], again["drawn"])
    assert "repeat_00001.npz belongs to repeat 1 of theirs; set aside as repeat_00001.broken" in caplog.text
    assert "repeat_00000.npz belongs to repeat 1 of theirs" in caplog.text


def test_repeat_without_a_stamp_is_set_aside(tmp_path, caplog):
    good = run(tmp_path)
    np.savez(tmp_path / "repeat_00001.npz", drawn=np.zeros((2, 3)), count=0)
    np.testing.assert_array_equal(run(tmp_path)["drawn"], good["drawn"])
    assert (tmp_path / "repeat_00001.broken").exists()


@QUICKLY
@given(data=st.data())
def test_damaged_section_never_stops_the_report(tmp_path_factory, data):
    folder = tmp_path_factory.mktemp("results")
    claim = ClaimResult("key", "here", "said", True, (CriterionResult("number", "3", "above 2", True),))
    good = Section(1, "Good", "All is well.", [], [claim], [], ["a remark"])
    write_section(folder / "good", good)
    write_section(folder / "bad", good._replace(title="Bad"))
    path = folder / "bad" / "section.json"
    content = path.read_bytes()
    values = ["null", "[]", "3", '"x"', "{}", "true", "[null]", "[{}]", "1e999"]
    if data.draw(st.booleans()):
        content = content[: data.draw(st.integers(0, len(content) - 1))]
    else:
        key = data.draw(st.sampled_from(["order", "title", "summary", "figures", "claims", "tables", "remarks"]))
        start = content.index(f'"{key}":'.encode())
        content = content[:start] + f'"{key}": {data.draw(st.sampled_from(values))},'.encode() + content[start:]
        content = content.replace(f'"{key}":'.encode(), b'"odd":') if data.draw(st.booleans()) else content
    path.write_bytes(content)
    assert "Good" in write_report(folder).read_text(encoding="utf-8")
