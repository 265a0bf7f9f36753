"""Experiment ``vision``: a few objects."""

import dataclasses
import json
import shutil

import numpy as np
import pytest
from scipy.optimize import minimize

from affordance.exceptions import BadValueError
from affordance.experiments.vision import experiment as vision
from affordance.experiments.vision.random_objects import MAX_PARTS, draw_object
from affordance.files.model_folder import MODELS
from affordance.vision.pixels.ellipsoid_fit import Fit, SeenEllipsoid
from affordance.vision.pixels.pipeline import Detection
from affordance.vision.pixels.rig import DEFAULT_RIG, find_box
from affordance.vision.pixels.segmentation import Segmentation

CONTRACT = (
    "objects",
    "failures",
    "semi_axis_error_visible_median",
    "semi_axis_error_depth_median",
    "mass_error_median",
    "mass_interval90_coverage",
    "ms_per_object",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The whole experiment with four objects, ten for coverage."""
    folder = tmp_path_factory.mktemp("vision")
    vision.run(vision.load_config(), folder, repeats=4, jobs=1)
    return folder


@pytest.fixture(scope="module")
def numbers(folder):
    return json.loads((folder / "metrics.json").read_text())


def test_results_keep_the_contract(folder, numbers):
    for key in CONTRACT:
        assert np.isfinite(numbers[key]), key
    assert numbers["objects"] == 4
    assert numbers["objects_coverage"] == 10
    for name in ("errors", "seen", "uncommon"):
        assert (folder / f"{name}.png").stat().st_size > 10_000
    assert (folder / "diagram.dot").exists()
    assert numbers["versions"]["opencv-python-headless"]


def test_objects_are_seen_as_well_as_was_asked(numbers):
    assert numbers["semi_axis_error_visible_median"] <= 0.03
    assert numbers["semi_axis_error_depth_median"] <= 0.08
    assert numbers["mass_error_median"] <= 0.06
    assert numbers["failures"] <= 1
    # Of ten objects nine are to be covered, with a standard deviation of one.
    assert numbers["mass_interval90_coverage"] >= 0.6


def test_question_of_figure_1_is_answered_with_probabilities(numbers):
    for who in ("mashing_novice", "mashing_expert"):
        answer = numbers[who]
        assert len(answer) == 4
        assert sum(entry["p_best"] for entry in answer) <= 1.0 + 1e-9
        cost_model = [entry["energy"] for entry in answer if entry["energy"] is not None]
        assert cost_model == sorted(cost_model)
    # Who never felt any of it is less sure.
    assert max(e["p_best"] for e in numbers["mashing_novice"]) < max(e["p_best"] for e in numbers["mashing_expert"])


def test_section_says_met_or_not_of_every_target(folder):
    section = json.loads((folder / "section.json").read_text())
    assert len(section["claims"]) == 5
    assert all(any(character.isdigit() for character in claim["found"]) for claim in section["claims"])


def test_targets_are_not_met_by_numbers_that_miss_them(folder, numbers):
    config = vision.load_config()
    arrays = {"failure": np.array(["NoFitError"]), "reason": np.array(["no ellipsoid"])}
    missed = {
        "semi_axis_error_visible_median": 0.04,
        "semi_axis_error_depth_median": 0.09,
        "mass_error_median": 0.07,
        "mass_interval90_coverage": 0.99,
        "ms_per_object": 1e4,
        "failures_by_kind": {"NoFitError": 1},
        "objects": 1,
    }
    ranking = vision.rank_uncommon(config, config.expert)
    section = vision.describe(arrays, {**numbers, **missed}, ranking, ranking)
    assert not any(claim.met for claim in section.claims)
    assert "1 NoFitError, such as: no ellipsoid" in section.summary


def test_same_object_and_noise_for_the_same_seed():
    config = vision.load_config()
    first, again = (vision.run_repeat(config, MODELS, 3) for _ in range(2))
    other = vision.run_repeat(dataclasses.replace(config, seed=1), MODELS, 3)
    for name in set(first) - {"seconds"}:
        np.testing.assert_array_equal(first[name], again[name])
    assert first["mass_error"] != other["mass_error"]


def test_object_that_is_not_made_out_is_counted_and_its_picture_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(vision, "draw_numbered_object", lambda seed, number: draw_crumb())
    kept = vision.run_repeat(vision.load_config(), tmp_path, 7)
    assert str(kept["failure"]) == "TooSmallError"
    assert "must cover at least" in str(kept["reason"])
    assert np.isnan(kept["mass_error"])
    assert (tmp_path / "frames" / "object_00007.npz").exists()
    assert (tmp_path / "frames" / "object_00007.png").exists()
    shapes = {name: values.shape for name, values in vision.run_repeat(vision.load_config(), tmp_path, 8).items()}
    assert {name: values.shape for name, values in kept.items()} == shapes


def draw_crumb():
    tool = draw_object(np.random.default_rng(0), "crumb")
    part = tool.components[0]
    small = dataclasses.replace(part, shape=part.shape.with_sizes(np.full(3, 0.006)))
    return dataclasses.replace(tool, components=(small,))


def test_random_objects_are_as_is_said():
    counts = set()
    for number in range(60):
        tool = draw_object(np.random.default_rng([5, number]), "thing")
        counts.add(len(tool.components))
        sizes = np.concatenate([part.shape.sizes for part in tool.components])
        assert sizes.min() >= 0.015
        assert sizes.max() <= 0.15
        low, high = find_box(tool)
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
        fits.append(Fit(ellipsoid, 1e-6 * np.eye(9), 1.0, 1000))
    labels = np.full((480, 640), -1, dtype=np.int32)
    colours = tuple(part.looks_like.colour for part in tool.components)
    found = vision.compare(
        tool, Detection(Segmentation(labels, len(fits)), tuple(reversed(fits)), tuple(reversed(colours)))
    )
    count = len(fits)
    np.testing.assert_allclose(found.visible_error[:count], 0.0, atol=1e-9)
    np.testing.assert_allclose(found.depth_error[:count], 0.0, atol=1e-9)
    np.testing.assert_allclose(found.colour_error[:count], 0.0, atol=1e-6)
    assert found.mass_error == pytest.approx(0.0, abs=1e-9)


def test_wrong_number_of_uncommon_objects_is_refused(tmp_path):
    shutil.copytree(MODELS, tmp_path / "models")
    path = tmp_path / "models" / "tools" / "uncommon.yaml"
    path.write_text(path.read_text().split("  - name: knobbed bar")[0])
    with pytest.raises(BadValueError, match=r"uncommon.yaml: tools: has 1 entries, must have 2"):
        vision.load_config(tmp_path / "models")


def test_mashing_that_cannot_be_planned_is_refused_by_file_and_key(tmp_path):
    shutil.copytree(MODELS, tmp_path / "models")
    path = tmp_path / "models" / "paths" / "mash.yaml"
    path.write_text(path.read_text().replace("[0, 0, -0.12]", "[1.2, 0, -0.12]"))
    with pytest.raises(BadValueError, match=r"mash.yaml: points: cannot be followed: "):
        vision.load_config(tmp_path / "models")
