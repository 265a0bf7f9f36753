"""Features from pictures: random objects, errors, failures, and the question of figure 1."""

import dataclasses

import numpy as np
import pytest
import xarray as xr
from helpers.results_files import read_section
from scipy.optimize import minimize
from scipy.stats import chi2

from affordance.experiments.shared.observers import Setup
from affordance.extensions.pixels.ellipsoid_fit import Fit, SeenEllipsoid
from affordance.extensions.pixels.experiments import random_objects, vision
from affordance.extensions.pixels.experiments.random_objects import MAX_PARTS, draw_object
from affordance.extensions.pixels.pipeline import Detection
from affordance.extensions.pixels.rig import DEFAULT_RIG
from affordance.extensions.pixels.segmentation import Segmentation
from affordance.objects.tool import find_box


def test_objects_are_seen_as_well_as_was_asked(shipped):
    numbers = shipped.numbers
    assert (numbers["objects"], numbers["objects_coverage"]) == (2, 5)
    assert numbers["semi_axis_error_visible_median"] <= 0.03
    assert numbers["semi_axis_error_depth_median"] <= 0.08
    assert numbers["mass_error_median"] <= 0.06
    assert numbers["failures"] == 0


def is_as_sure_as_it_should_be(deviations):
    """Judges errors over their stated deviations, (N,): their squares have a sum distributed as chi-squared.

    A share of ten covered intervals cannot distinguish 90 % from the 63 to 65 % that there were before residuals of
    the fit were centred (docs/decisions/0015-vision-from-pixels.md): then deviations were 1.8 times what was claimed.
    """
    low, high = chi2.ppf([0.001, 0.999], len(deviations))
    return bool(low <= (deviations**2).sum() <= high)


def test_masses_are_as_sure_as_they_are_claimed_to_be(shipped):
    more = [float(vision.observe(Setup(), number).mass_deviation) for number in range(5, 20)]
    deviations = np.array([*shipped.data.mass_deviation.values, *more])
    deviations = deviations[np.isfinite(deviations)]
    assert len(deviations) >= 18
    assert is_as_sure_as_it_should_be(deviations)
    assert not is_as_sure_as_it_should_be(1.8 * deviations)


def test_question_of_figure_1_is_answered_with_probabilities(shipped):
    numbers = shipped.numbers
    for who in ("mashing_novice", "mashing_expert"):
        answer = numbers[who]
        assert len(answer) == 4
        assert sum(entry["p_best"] for entry in answer) <= 1.0 + 1e-9
        works = [entry["energy"] for entry in answer if entry["energy"] is not None]
        assert works == sorted(works)
    # An observer who never felt the materials is less sure.
    assert max(e["p_best"] for e in numbers["mashing_novice"]) < max(e["p_best"] for e in numbers["mashing_expert"])
    (ranking,) = read_section(shipped.folder).tables
    assert len(ranking["rows"]) == 8
    assert {row[0] for row in ranking["rows"]} == {"novice (materials never felt)", "expert (materials known)"}


def test_failures_are_counted_by_kind_with_an_example(shipped):
    failed = {"failures": 3, "failures_by_kind": {"NoFitError": 2, "WrongParts": 1}}
    examples = {"NoFitError": "no ellipsoid", "WrongParts": "2 parts detected of an object of 3"}
    said = vision.summarise({**shipped.numbers, **failed, "failure_examples": examples})
    assert "Not detected: 3 (2 NoFitError, such as: no ellipsoid; 1 WrongParts, such as: 2 parts" in said
    assert "Not detected: 0;" in shipped.summary
    assert "failures" not in shipped.captions


def test_same_object_and_noise_for_the_same_seed(shipped):
    """An object of the whole experiment is seen the same when it is seen again alone, and another by another seed."""
    first, again = shipped.data.isel(object=3), vision.observe(Setup(), 3)
    for name in set(again.data_vars) - {"seconds"}:
        np.testing.assert_array_equal(first[name], again[name])
    assert float(again.mass_error) != float(vision.observe(Setup(seed=1), 3).mass_error)


def draw_crumb():
    tool = draw_object(np.random.default_rng(0), "crumb")
    part = tool.components[0]
    small = dataclasses.replace(part, shape=part.shape.with_sizes(np.full(3, 0.006)))
    return dataclasses.replace(tool, components=(small,))


def replace_objects(monkeypatch, draw):
    for module in (random_objects, vision):
        monkeypatch.setattr(module, "draw_numbered_object", draw)


def test_object_that_is_not_detected_is_counted_and_its_picture_kept(tmp_path, monkeypatch):
    """Every other object is too small to be detected."""
    draw = random_objects.draw_numbered_object
    replace_objects(monkeypatch, lambda seed, number: draw_crumb() if number % 2 else draw(seed, number))
    results = vision.run(Setup(observers=2, out=tmp_path))
    numbers = results.numbers
    assert (numbers["objects"], numbers["failures"], numbers["failures_coverage"]) == (2, 1, 2)
    assert numbers["failures_by_kind"] == {"TooSmallError": 1}
    assert "must cover at least" in numbers["failure_examples"]["TooSmallError"]
    assert "Not detected: 1 (1 TooSmallError, such as: " in results.summary
    assert [*results.figures][-1] == "failures"
    assert [*results.files] == ["object_00001", "object_00003"]
    (tmp_path / "vision").mkdir(exist_ok=True)
    for write in results.files.values():
        write(tmp_path / "vision")
    frames = sorted(path.name for path in (tmp_path / "vision" / "frames").iterdir())
    assert frames == [f"object_{number:05d}.{kind}" for number in (1, 3) for kind in ("npz", "png")]


def test_data_of_what_is_not_detected_have_the_shapes_of_what_is(shipped, monkeypatch):
    replace_objects(monkeypatch, lambda seed, number: draw_crumb())
    missed, detected = vision.observe(Setup(), 0), shipped.data.isel(object=0)
    assert (str(detected.failure.values), str(missed.failure.values)) == ("", "TooSmallError")
    assert np.isnan(missed.mass_error)
    assert {name: missed[name].shape for name in missed.data_vars} == {
        name: detected[name].shape for name in detected.data_vars
    }


def test_wrong_number_of_parts_is_a_failure(monkeypatch):
    tool, picture = vision.draw_numbered_object(0, 0), vision.take_picture(0, 0)
    twice = dataclasses.replace(tool, components=tool.components * 2)
    monkeypatch.setattr(vision, "take_picture", lambda seed, number: picture)
    monkeypatch.setattr(vision, "draw_numbered_object", lambda seed, number: twice)
    found = vision.observe(Setup(), 0)
    count = len(tool.components)
    assert str(found.failure.values) == "WrongParts"
    assert str(found.reason.values) == f"{count} parts detected of an object of {2 * count}"


def test_numbers_where_nothing_was_detected_are_none(monkeypatch):
    replace_objects(monkeypatch, lambda seed, number: draw_crumb())
    data = xr.concat([vision.observe(Setup(), number) for number in range(2)], "object")
    numbers = vision.measure(data.assign(seconds=("object", [0.1, 0.1])), 2)
    for key in ("mass_error_median", "mass_bias_median", "mass_interval90_coverage", "colour_error_median"):
        assert numbers[key] is None
    assert not any(claim.met for claim in vision.judge(numbers))


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
    found = vision.compare(
        tool, Detection(Segmentation(labels, len(fits)), tuple(reversed(fits)), tuple(reversed(colours)))
    )
    count = len(fits)
    np.testing.assert_allclose(found.visible_error[:count], 0.0, atol=1e-9)
    np.testing.assert_allclose(found.depth_error[:count], 0.0, atol=1e-9)
    np.testing.assert_allclose(found.colour_error[:count], 0.0, atol=1e-6)
    assert float(found.mass_error) == pytest.approx(0.0, abs=1e-9)
