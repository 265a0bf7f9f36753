"""Both sources of features come out of one port."""

import dataclasses

import numpy as np
import pytest
from helpers.results_files import read_numbers

from affordance.belief.material_memory import MaterialMemory
from affordance.belief.normals import Normals
from affordance.commands.catalogue import find_experiment
from affordance.exceptions import NothingSeenError
from affordance.experiments import weight
from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.suite import run_suite
from affordance.extensions.pixels import camera_sensor, pixel_eye
from affordance.extensions.pixels.camera_sensor import CameraSensor, get_camera_sensor
from affordance.files.frames import save_frame
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.plant.load import load_arm
from affordance.proprioception.static_hold import StaticHold
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.trial import TrialRunner
from affordance.vision.eye import observe
from affordance.vision.features import VisionError
from affordance.vision.prediction import predict_object

PIXELS = dataclasses.replace(DEFAULT_SETTINGS, eye=pixel_eye.PIXELS)
MATERIALS = load_materials(MODELS / "materials.yaml")
STICK, *_ = load_tools(MODELS / "tools" / "novel.yaml", MATERIALS)
EXPERT = MaterialMemory.from_densities({material.colour: material.density for material in MATERIALS.values()})


def take_features(tool):
    return observe(tool, pixel_eye.PIXELS, VisionError(), np.random.default_rng(0))


def test_features_from_pictures_are_those_of_the_grip_in_the_hand():
    by_wood, by_steel = (STICK.gripped_by(grip) for grip in STICK.grips)
    for tool in (by_wood, by_steel):
        belief = predict_object(take_features(tool), EXPERT, PIXELS.prior)
        mean = belief.compute_parameters(belief.densities.compute_mean())
        com = mean[1:4] / mean[0]
        np.testing.assert_allclose(com, tool.p_TTcm, atol=0.004)


def test_perfect_picture_of_an_appearance_is_taken_once(monkeypatch):
    perfect = get_camera_sensor().render(STICK)
    rendered = []
    monkeypatch.setattr(camera_sensor, "render", lambda tool, rig: rendered.append(tool) or perfect)
    sensor = CameraSensor()
    for seed in range(3):
        sensor.take_image(STICK, np.random.default_rng(seed))
    assert len(rendered) == 1


def test_port_of_the_trial_shows_what_was_seen():
    runner = TrialRunner(PIXELS)
    tool = STICK.gripped_by(STICK.grips[0])
    memory = MaterialMemory().add_colours([part.looks_like.colour for part in tool.components], PIXELS.prior)
    first, again, other = (runner.run_hold(tool, memory, duration=0.2, seed=seed) for seed in ((1,), (1,), (2,)))
    np.testing.assert_array_equal(first.q, again.q)
    assert first.log_evidence == again.log_evidence
    assert (first.q != other.q).any()
    assert first.memory.colours == memory.colours


def test_geometry_seen_is_no_noise_of_the_joints():
    """Uncertain geometry lowers the precision of densities in sum; its determinant adds a little."""
    tool = STICK.gripped_by(STICK.grips[0])
    seen = take_features(tool)
    exact = [dataclasses.replace(part, deformations=np.zeros((0, 4, 4))) for part in seen]
    hold = StaticHold(load_arm())
    precisions = []
    for features in (seen, exact):
        belief = predict_object(features, EXPERT, PIXELS.prior)
        rho = EXPERT.belief.untruncated_mean[list(belief.colours)]
        statistics = hold.measure(belief, rho, PIXELS.noise, (1,))
        felt = PIXELS.noise.describe(statistics.features, 1, len(hold.tau_arm), belief.geometry)
        known = Normals(rho[None], np.eye(len(rho))[None])  # so well that the likelihood is that at these densities
        precisions.append(felt.find_likelihood(known).precision[0])
    assert np.trace(precisions[0]) < np.trace(precisions[1])


def blind(self, picture):
    raise NothingSeenError("nothing is nearer than the stand", *picture)


def test_picture_that_shows_nothing_names_the_object(monkeypatch):
    monkeypatch.setattr(CameraSensor, "detect_parts", blind)
    with pytest.raises(NothingSeenError, match="stick: nothing is nearer than the stand") as caught:
        take_features(STICK)
    assert caught.value.depth.shape == (480, 640)


@pytest.mark.parametrize(("name", "tool"), [("weight", "rod_10cm"), ("reach", "stick"), ("hammer", "stick")])
def test_experiment_ends_at_a_picture_that_shows_nothing_and_keeps_it(monkeypatch, tmp_path, name, tool):
    """A picture that shows nothing ends the experiment and is kept, also where it is taken for planning."""
    monkeypatch.setattr(CameraSensor, "detect_parts", blind)
    with pytest.raises(
        NothingSeenError, match=rf"{tool}: nothing is nearer .* \(picture saved as .*\.npz\)"
    ) as caught:
        run_suite({name: find_experiment(name)}, Setup(observers=1, out=tmp_path, settings=PIXELS))
    with np.load(caught.value.frame) as kept:
        np.testing.assert_array_equal(kept["colour"], caught.value.colour)
        np.testing.assert_array_equal(kept["depth"], caught.value.depth)
    assert (tmp_path / "frames" / "NothingSeenError.png").stat().st_size > 10_000
    assert not (tmp_path / name / "metrics.json").exists()


@pytest.mark.parametrize("shape", [(1, 1), (5, 4)])
def test_frames_of_any_size_and_depth_are_kept(tmp_path, shape):
    depth = np.full(shape, np.nan)
    error = NothingSeenError("nothing", np.zeros((*shape, 3), dtype=np.uint8), depth)
    saved = save_frame(error, tmp_path, "frame")
    assert type(saved) is NothingSeenError
    assert (tmp_path / "frame.png").exists()
    mismatched = NothingSeenError("nothing", np.zeros((2, 2, 3), dtype=np.uint8), depth)
    save_frame(mismatched, tmp_path, "other")
    assert (tmp_path / "other.npz").exists()
    assert not (tmp_path / "other.png").exists()


def test_simulation_1_keeps_its_claims_when_objects_are_seen(tmp_path, monkeypatch):
    """One observer's drop, density and reaction to the decoy meet the claims; the report shows its pictures."""
    monkeypatch.setattr(weight, "DURATION", 1.0)
    run_suite(["weight"], Setup(observers=1, out=tmp_path, settings=PIXELS))
    numbers = read_numbers(tmp_path / "weight")
    assert numbers["config"]["settings"]["eye"] == "pixels"
    assert abs(numbers["density_median"][-1] / numbers["density_true"] - 1.0) < 0.1
    assert numbers["drop_m"][3] < 0.25 * numbers["drop_m"][0]
    assert numbers["decoy_rises"] == 1.0
    assert "seen.png" in (tmp_path / "weight" / "section.json").read_text(encoding="utf-8")
    assert (tmp_path / "weight" / "seen.png").stat().st_size > 10_000
