"""The study of pictures: its scenes and tables, true volumes, and what a weighing tells."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.refusals import refuse
from helpers.results_files import read_numbers
from helpers.study_runs import run_study

from affordance.exceptions import NothingSeenError
from affordance.extensions.pixels.photographs.example import CANS, cast_example
from affordance.extensions.pixels.photographs.see import see
from affordance.files.bounded import read_yaml
from studies.pictures import command
from studies.pictures.command import STUDY, draw_masses, tabulate_masses, tabulate_readings
from studies.pictures.photographs import LABELS, Reading, check_data, measure_volume
from studies.pictures.scenes import draw_scene


def read_example(name, picture, kind="liquid"):
    picture_of, camera = cast_example(name)
    radius, height, mass = CANS[name]
    seen = see(picture_of.colour, picture_of.depth, camera)
    return Reading(picture, "000_can", seen, np.pi * radius**2 * height, mass, kind)


@pytest.fixture(scope="module")
def readings():
    return [read_example("can", "000001"), read_example("can", "000002")]


def test_scenes_go_through_kinds_and_show_the_object():
    scenes = [draw_scene(0, number) for number in range(3)]
    assert [scene.kind for scene in scenes] == ["box", "cylinder", "superquadric"]
    for scene in scenes:
        u, v = (round(each) for each in scene.at)
        near = scene.picture.depth[v - 5 : v + 6, u - 5 : u + 6]
        assert abs(np.nanmedian(near[near > 0.0]) - scene.centre[2]) < 0.15


def test_refused_scene_is_counted_and_has_no_error(monkeypatch, capsys):
    def refuse_picture(*arguments, **options):
        raise NothingSeenError("nothing", *cast_example("can")[0])

    monkeypatch.setattr(command, "see", refuse_picture)
    found = [command.run_scene(command.PicturesConfig(0), number) for number in range(2)]
    seen = {name: 0.1 * np.ones_like(value, dtype=float) for name, value in found[0].items()}
    seen |= {"good": np.array(True), "parts": np.array(1), "kind": np.array(0)}
    numbers = command.tabulate_scenes({name: np.stack([each[name] for each in (*found, seen)]) for name in seen})
    assert (numbers["all"]["scenes"], numbers["all"]["refused"]) == (3, 2)
    assert numbers["all"]["median_volume_error"] == pytest.approx(np.expm1(0.1))
    assert "| all | 3, 2 |" in capsys.readouterr().out


def test_volume_of_a_surface_is_that_of_its_hull_or_of_a_closing():
    points = np.random.default_rng(0).normal(size=(4000, 3))
    ball = 0.05 * points / np.linalg.norm(points, axis=1, keepdims=True)
    truth = 4.0 / 3.0 * np.pi * 0.05**3
    assert measure_volume(ball, is_concave=False) == pytest.approx(truth, rel=0.02)
    assert measure_volume(ball, is_concave=True) == pytest.approx(truth, rel=0.1)


def test_outlines_are_polygons_of_labelled_objects_within_the_picture():
    labels = read_yaml(LABELS)
    for outlines in labels["pictures"].values():
        for name, corners in outlines.items():
            assert name in labels["objects"]
            assert np.array(corners).reshape(-1, 2).min() >= 0
            assert (np.array(corners).reshape(-1, 2).max(axis=0) < [640, 480]).all()
    assert sum(map(len, labels["pictures"].values())) == 21


def test_words_and_a_weighing_narrow_the_mass(readings, capsys):
    widths = []
    # A volume that is known to 30 %: how well the picture shows it does not matter here.
    seen = readings[1].seen
    known = readings[1]._replace(seen=replace(seen, parts=(replace(seen.parts[0], volume_sd=0.3),)))
    for masses in (
        draw_masses(known, "household_thing", knows=False),
        draw_masses(known, "household_thing"),
        draw_masses(known, "holds_liquid"),
        draw_masses(known, "household_thing", weighed=known),
    ):
        low, high = np.quantile(masses, [0.05, 0.95])
        assert low < CANS["can"][2] < high
        widths.append(high - low)
    assert widths[0] > 2.0 * widths[1]
    assert widths[1] > 1.2 * max(widths[2:])
    numbers = tabulate_masses(readings)
    assert numbers["weighed once, in another picture"]["readings"] == 2
    assert numbers["constant guess, 0.18 kg"]["min_ratio_error"] == pytest.approx(0.18 / 0.46)
    assert tabulate_readings(readings)["inside"][1] == 1.0
    assert "| 1 | can | 0.45 |" in capsys.readouterr().out


def test_the_study_prints_and_writes_its_table(tmp_path, capsys):
    run_study(STUDY, "--repeats", 3, "--jobs", 1, "--out", tmp_path)
    numbers = read_numbers(tmp_path / "pictures")
    assert numbers["scenes"]["all"]["scenes"] == 3
    assert "| all | 3, 0 |" in capsys.readouterr().out
    assert "must be a clone of github.com/yuxng/PoseCNN" in refuse(check_data, tmp_path)
