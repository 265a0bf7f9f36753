"""The study of features from pictures: a few objects."""

import dataclasses

import numpy as np
import pytest
from helpers.results_files import check_keys, read_numbers, read_section, render
from helpers.shared import compute_once, make_folder_once
from matplotlib.figure import Figure
from scipy.optimize import minimize
from scipy.stats import chi2

from affordance.choice.ranking import Ranking
from affordance.experiments.runner import run_experiment
from affordance.objects.tool import find_box
from affordance.vision.pixels.ellipsoid_fit import Fit, SeenEllipsoid
from affordance.vision.pixels.pipeline import Detection
from affordance.vision.pixels.rig import DEFAULT_RIG
from affordance.vision.pixels.segmentation import Segmentation
from studies.vision import comparison
from studies.vision import experiment as vision
from studies.vision.random_objects import MAX_PARTS, draw_object

SHAPES = (
    "objects",
    "failures",
    "semi_axis_error_visible_median",
    "semi_axis_error_depth_median",
    "mass_error_median",
    "mass_interval90_coverage",
    "ms_per_object",
)


@pytest.fixture(scope="module")
def experiment():
    return vision.load()


@pytest.fixture(scope="module")
def rankings(experiment, tmp_path_factory):
    return compute_once(tmp_path_factory, "rankings", experiment.rank_uncommon)


@pytest.fixture(scope="module")
def folder(experiment, rankings, tmp_path_factory):
    """The whole experiment with four objects, ten for coverage."""

    def fill(folder):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(vision.VisionExperiment, "rank_uncommon", lambda self: rankings)
            run_experiment(experiment, experiment.plan(jobs=1), folder / "vision", repeats=4, jobs=1)

    return make_folder_once(tmp_path_factory, "results_vision", fill) / "vision"


@pytest.fixture(scope="module")
def numbers(folder):
    return read_numbers(folder)


def test_results_are_as_documented(folder, numbers):
    for key in SHAPES:
        assert np.isfinite(numbers[key]), key
    assert numbers["objects"] == 4
    assert numbers["objects_coverage"] == 10
    for name in ("errors", "seen", "uncommon"):
        assert (folder / f"{name}.png").stat().st_size > 10_000
    assert (folder / "diagram.dot").exists()
    assert numbers["versions"]["opencv-python-headless"]
    check_keys(numbers, "vision")


def test_objects_are_seen_as_well_as_was_asked(numbers):
    assert numbers["semi_axis_error_visible_median"] <= 0.03
    assert numbers["semi_axis_error_depth_median"] <= 0.08
    assert numbers["mass_error_median"] <= 0.06
    assert numbers["failures"] <= 1


def is_as_sure_as_it_should_be(deviations):
    """Judges errors over their stated deviations, (N,): their squares have a sum distributed as chi-squared.

    A share of ten covered intervals cannot tell 90 % from the 63 to 65 % that the study found before residuals of the
    fit were centred (docs/decisions/0015-vision-from-pixels.md): then deviations were 1.8 times what was claimed.
    """
    low, high = chi2.ppf([0.001, 0.999], len(deviations))
    return bool(low <= (deviations**2).sum() <= high)


def test_masses_are_as_sure_as_they_are_claimed_to_be(experiment, folder):
    kept = [np.load(path)["mass_deviation"] for path in sorted((folder / "repeats").rglob("repeat_*.npz"))]
    more = [experiment.run_observer(None, None, number)["mass_deviation"] for number in range(len(kept), 24)]
    deviations = np.array([*kept, *more], dtype=float)
    deviations = deviations[np.isfinite(deviations)]
    assert len(kept) == 10
    assert len(deviations) >= 22
    assert is_as_sure_as_it_should_be(deviations)
    assert not is_as_sure_as_it_should_be(1.8 * deviations)


def test_question_of_figure_1_is_answered_with_probabilities(numbers):
    for who in ("mashing_novice", "mashing_expert"):
        answer = numbers[who]
        assert len(answer) == 4
        assert sum(entry["p_best"] for entry in answer) <= 1.0 + 1e-9
        works = [entry["energy"] for entry in answer if entry["energy"] is not None]
        assert works == sorted(works)
    # An observer who never felt the materials is less sure.
    assert max(e["p_best"] for e in numbers["mashing_novice"]) < max(e["p_best"] for e in numbers["mashing_expert"])


def test_section_says_met_or_not_of_every_claim(folder):
    section = read_section(folder)
    assert len(section.claims) == 5
    for claim in section.claims.values():
        assert all(any(character.isdigit() for character in each["value"]) for each in claim.criteria)
    (ranking,) = section.tables
    assert len(ranking["rows"]) == 8
    assert {row[0] for row in ranking["rows"]} == {"who never felt the materials", "who knows the materials"}
    assert "Not detected: 0;" in section.summary
    assert not any(figure["file"] == "failures.png" for figure in section.figures)


def test_failures_are_counted_by_kind_with_an_example(experiment, numbers):
    failed = {"failures": 3, "failures_by_kind": {"NoFitError": 2, "WrongParts": 1}}
    examples = {"NoFitError": "no ellipsoid", "WrongParts": "2 parts detected of an object of 3"}
    section = render(experiment, None, numbers, **failed, failure_examples=examples)
    assert "Not detected: 3 (2 NoFitError, such as: no ellipsoid; 1 WrongParts, such as: 2 parts" in section.summary
    assert any(figure.file == "failures.png" for figure in section.figures)


def test_same_object_and_noise_for_the_same_seed(experiment, folder):
    """A repeat of the whole experiment is the same when it is run again alone, and another for another seed."""
    (path,) = (folder / "repeats").rglob("repeat_00003.npz")
    first, again = np.load(path), experiment.run_observer(None, None, 3)
    other = dataclasses.replace(experiment, seed=1).run_observer(None, None, 3)
    for name in set(again) - {"seconds"}:
        np.testing.assert_array_equal(first[name], again[name])
    assert first["mass_error"] != other["mass_error"]


@pytest.fixture(scope="module")
def folder_of_crumbs(experiment, rankings, tmp_path_factory):
    """The whole experiment where every other object is too small to be detected."""
    draw = vision.draw_numbered_object

    def draw_some_crumbs(seed, number):
        return draw_crumb() if number % 2 else draw(seed, number)

    def fill(folder):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(vision, "draw_numbered_object", draw_some_crumbs)
            patch.setattr(vision.VisionExperiment, "rank_uncommon", lambda self: rankings)
            patch.setattr(vision.VisionExperiment, "_draw_uncommon", lambda self: Figure())
            run_experiment(experiment, None, folder / "vision", repeats=2, jobs=1)

    return make_folder_once(tmp_path_factory, "results_vision_of_crumbs", fill) / "vision"


def test_object_that_is_not_detected_is_counted_and_its_picture_kept(folder_of_crumbs):
    numbers = read_numbers(folder_of_crumbs)
    assert (numbers["objects"], numbers["failures"], numbers["failures_coverage"]) == (2, 1, 2)
    assert numbers["failures_by_kind"] == {"TooSmallError": 1}
    assert "must cover at least" in numbers["failure_examples"]["TooSmallError"]
    frames = sorted(path.name for path in (folder_of_crumbs / "frames").iterdir())
    assert frames == [f"object_{number:05d}.{kind}" for number in (1, 3) for kind in ("npz", "png")]
    section = read_section(folder_of_crumbs)
    assert "Not detected: 1 (1 TooSmallError, such as: " in section.summary
    assert [figure["file"] for figure in section.figures][-1] == "failures.png"
    assert (folder_of_crumbs / "failures.png").stat().st_size > 10_000


def test_arrays_of_what_is_not_detected_have_the_shapes_of_what_is(experiment, folder, monkeypatch):
    (path,) = (folder / "repeats").rglob("repeat_00000.npz")
    with np.load(path) as kept:
        detected = {name: kept[name] for name in kept.files if name != "belongs_to"}  # a key of the file
    monkeypatch.setattr(vision, "draw_numbered_object", lambda seed, number: draw_crumb())
    missed = experiment.run_observer(None, None, 0)
    assert (str(detected["failure"]), str(missed["failure"])) == ("", "TooSmallError")
    assert np.isnan(missed["mass_error"])
    assert {name: np.shape(values) for name, values in missed.items()} == {
        name: np.shape(values) for name, values in detected.items()
    }


def test_wrong_number_of_parts_is_a_failure(experiment, monkeypatch):
    draw = vision.draw_numbered_object
    tool = draw(0, 0)
    twice = dataclasses.replace(tool, components=tool.components * 2)
    picture = vision.take_numbered_picture(0, 0)
    monkeypatch.setattr(vision, "take_numbered_picture", lambda seed, number: picture)
    monkeypatch.setattr(vision, "draw_numbered_object", lambda seed, number: twice)
    found = experiment.run_observer(None, None, 0)
    count = len(tool.components)
    assert str(found["failure"]) == "WrongParts"
    assert str(found["reason"]) == f"{count} parts detected of an object of {2 * count}"


def test_numbers_where_nothing_was_detected_are_none(experiment, numbers, monkeypatch):
    monkeypatch.setattr(vision.VisionExperiment, "rank_uncommon", lambda self: (NOTHING, NOTHING))
    arrays = {name: np.array([value] * 5) for name, value in comparison.NOTHING._asdict().items()}
    arrays |= {"failure": np.array(["NoFitError"] * 5), "reason": np.array(["x"] * 5), "seconds": np.full(5, 0.1)}
    found = experiment.compute_metrics(None, None, arrays)
    for key in ("mass_error_median", "mass_bias_median", "mass_interval90_coverage", "colour_error_median"):
        assert found[key] is None
    ranked = {key: numbers[key] for key in ("mashing_novice", "mashing_expert")}
    section = render(experiment, None, {**found, **ranked})
    assert [claim.key for claim in section.claims if claim.met] == ["time"]


NOTHING = Ranking((), num_usable=0, min_feasibility=0.95, p_none=1.0, flips=False)


def draw_crumb():
    tool = draw_object(np.random.default_rng(0), "crumb")
    part = tool.components[0]
    small = dataclasses.replace(part, shape=part.shape.with_sizes(np.full(3, 0.006)))
    return dataclasses.replace(tool, components=(small,))


def test_random_objects_are_as_is_said():
    counts = set()
    for number in range(30):
        tool = draw_object(np.random.default_rng([5, number]), "thing")
        counts.add(len(tool.components))
        sizes = np.concatenate([part.shape.sizes for part in tool.components])
        assert 0.015 <= sizes.min() <= sizes.max() <= 0.15
        low, high = find_box(tool.components)
        assert (high - low <= (0.55, 0.40, 0.30)).all()
        for one, other in zip(tool.components, tool.components[1:], strict=False):
            # The widest gap between planes across any direction is nothing: they touch and do not overlap.
            assert find_widest_gap(one, other) == pytest.approx(0.0, abs=1e-7)
    assert counts == set(range(1, MAX_PARTS + 1))


def support(part, direction):
    R_TE = part.X_TE[:3, :3]
    return part.X_TE[:3, 3] + R_TE @ part.shape.find_support(R_TE.T @ direction)


def find_widest_gap(one, other):
    """The largest distance between two parallel planes that separate two solids, negative if they overlap, [m]."""

    def close(direction):
        unit = direction / np.linalg.norm(direction)
        return -float(unit @ (support(other, -unit) - support(one, unit)))

    offset = other.X_TE[:3, 3] - one.X_TE[:3, 3]
    options = {"xatol": 1e-10, "fatol": 1e-14, "maxiter": 4000}
    return -minimize(close, offset / np.linalg.norm(offset), method="Nelder-Mead", options=options).fun


def test_perfect_sight_compares_without_error():
    tool = draw_object(np.random.default_rng(1), "thing")
    X_CT = np.linalg.inv(DEFAULT_RIG.compute_camera_pose(tool))
    fits = []
    for part in tool.components:
        R = X_CT[:3, :3] @ part.X_TE[:3, :3]
        ellipsoid = SeenEllipsoid((X_CT @ part.X_TE)[:3, 3], (R * part.shape.sizes**2) @ R.T)
        fits.append(Fit(ellipsoid, 1e-6 * np.eye(9), 1.0))
    labels = np.full((480, 640), -1, dtype=np.int32)
    colours = tuple(part.looks_like.colour for part in tool.components)
    found = comparison.compare(
        tool, Detection(Segmentation(labels, len(fits)), tuple(reversed(fits)), tuple(reversed(colours)))
    )
    count = len(fits)
    np.testing.assert_allclose(found.visible_error[:count], 0.0, atol=1e-9)
    np.testing.assert_allclose(found.depth_error[:count], 0.0, atol=1e-9)
    np.testing.assert_allclose(found.colour_error[:count], 0.0, atol=1e-6)
    assert found.mass_error == pytest.approx(0.0, abs=1e-9)
