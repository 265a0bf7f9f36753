"""Ladder of learners: what is held, with which arm, the numbers by hand, and claims that decide."""

import dataclasses

import numpy as np
import pytest
import xarray as xr
from helpers.changed_files import change_file
from helpers.refusals import refuse

from affordance.belief.learners import KINDS_MAP
from affordance.exceptions import InfeasibleError
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments import ladder
from affordance.objects.appearance import is_same_object
from affordance.plant.load import load_arm
from affordance.proprioception.torque_noise import WeberNoise, WhiteNoise
from affordance.vision.eye import measure_drawing

SETUP = Setup()
RUNGS = ["nothing_remembered", "own_memory", "density"]


@pytest.fixture(scope="module")
def tools():
    return ladder.read(SETUP)


def look(tool):
    return [part.appearance for part in measure_drawing(tool)]


def test_the_first_decoy_looks_like_the_last_rod_and_the_second_like_none(tools):
    *rods, decoy, new_decoy = tools["adult"]
    assert [is_same_object(look(decoy), look(rod)) for rod in rods] == [False, False, False, True]
    assert not any(is_same_object(look(new_decoy), look(rod)) for rod in (*rods, decoy))
    assert {part.looks_like.name for tool in tools["adult"] for part in tool.components} == {"brass"}


def test_rods_of_the_infant_are_scaled_by_reach_as_its_wrist_cannot_hold_the_others(tools):
    ratio = 0.341 / 0.7744
    for adult, infant in zip(*(tools[arm] for arm in ladder.ARMS), strict=True):
        assert infant.mass / adult.mass == pytest.approx(ratio**3)
        np.testing.assert_allclose(infant.p_TTcentre, ratio * adult.p_TTcentre)
    with pytest.raises(InfeasibleError, match=r"rod_15cm: weighs 0\.601 kg and loads wrist_flexion"):
        ladder.check_can_be_held("x", tools["adult"], ladder.set_up_arm(SETUP, "infant").settings)


@pytest.mark.parametrize(("noise", "least"), [(WeberNoise(), "threshold"), (WhiteNoise(), "sd")])
def test_least_torque_that_is_felt_is_scaled_as_efforts_are(noise, least):
    setup = SETUP.change(noise=noise)
    found = ladder.set_up_arm(setup, "infant").settings
    assert getattr(found.noise, least) == pytest.approx(9.16 / 73.0 * getattr(noise, least), rel=2e-3)
    assert dataclasses.replace(found.noise, **{least: getattr(noise, least)}) == noise
    assert load_arm(found.arm).plant.HasBodyNamed("upper_arm")
    assert ladder.set_up_arm(setup, "adult") is setup


def test_every_rung_is_seen_with_two_observers(shipped):
    assert {claim.key for claim in shipped.claims if not claim.met} <= {"decoys"}  # of a bound, by a hair
    assert shipped.data.height.dims == ("arm", "learner", "observer", "trial", "time")
    assert shipped.data.learner.values.tolist() == RUNGS
    for arm in ladder.ARMS:
        found = shipped.numbers["arms"][arm]
        first = {learner: found[learner]["first_m"] for learner in RUNGS}
        np.testing.assert_array_equal(first["nothing_remembered"], first["own_memory"])
        assert first["density"][0] == first["own_memory"][0]
        np.testing.assert_array_equal(found["nothing_remembered"]["first_m"], found["nothing_remembered"]["second_m"])


def test_each_decoy_is_held_with_the_memory_that_the_rods_left(shipped):
    density = shipped.lifts.query("learner == 'density' and block == 'adult' and observer == 1")
    assert density["object"].tolist()[-3:] == ["rod_25cm", "decoy", "decoy_of_new_length"]
    believed = density["believed_density"].to_numpy()
    assert believed[-1] == believed[-2] != believed[-3]
    assert density["cycle"].tolist() == [1, 2] * 4 + [1, 1]


def test_numbers_of_made_up_heights_by_hand():
    """Two rods that are held twice, and two decoys."""
    peaks = np.array([[-3.0, 1.0, -5.0, -2.0, 4.0, 6.0], [-1.0, -1.0, -3.0, 2.0, 2.0, -2.0]])
    height = np.stack([0.5 * peaks, peaks, -0.9 * peaks], axis=-1)
    data = xr.Dataset({"height": (("learner", "observer", "trial", "time"), height[None])}, {"learner": ["mine"]})
    found = ladder.summarise(data)["mine"]
    assert found["first_m"].tolist() == [-2.0, -4.0]
    assert found["second_m"].tolist() == [0.0, 0.0]
    assert found["second_size_m"].tolist() == [1.0, 2.0]
    assert (found["decoy_m"], found["new_decoy_m"]) == (3.0, 2.0)


def test_another_learner_is_a_rung_of_its_own():
    assert [each.name for each in ladder.list_rungs(SETUP)] == RUNGS
    assert [each.name for each in ladder.list_rungs(SETUP.change(learner="kinds_map"))] == [*RUNGS, KINDS_MAP.name]


def test_models_without_an_infant_and_objects_that_are_too_few_are_refused(models):
    (models / ladder.INFANT).rename(models / "other.yaml")
    setup = Setup(models=models)
    assert "infant.dmd.yaml: is missing, must be in the folder of models" in refuse(ladder.read, setup)
    (models / "other.yaml").rename(models / ladder.INFANT)
    file = models / "tools" / "ladder.yaml"
    head, *rods = file.read_text(encoding="utf-8").split("  - name: ")
    file.write_text("  - name: ".join([head, *rods[-3:]]), encoding="utf-8")
    assert "ladder.yaml: tools: has 3 entries, must have at least 4" in refuse(ladder.read, setup)


def test_a_rod_that_the_infant_cannot_hold_is_refused(models):
    change_file(models / "infant.sdf", "<effort>0.891<", "<effort>0.1<")
    message = refuse(ladder.read, Setup(models=models), error=InfeasibleError)
    assert "loads wrist_flexion" in message
