"""What is lifted next: the order of the lifts, what is known of each object, and the numbers by hand."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from affordance.belief.learners import LEARNERS
from affordance.belief.material_memory import MaterialMemory, start_memory
from affordance.experiments.shared.observers import Setup
from affordance.extensions.advice.experiments import next_lift
from affordance.plant.load import load_arm
from affordance.proprioception.estimator import condition_on_torques
from affordance.proprioception.static_hold import StaticHold
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.eye import measure_drawing
from affordance.vision.prediction import predict_object

THINGS, _ = next_lift.read(Setup())
NAMES = [thing.name for thing in THINGS]
ROD = THINGS[0]


def test_each_object_is_held_once_the_familiar_ones_first_and_then_the_odd_one(shipped):
    orders = shipped.data.object.values.reshape(-1, len(THINGS))
    assert len(orders) == 2 * 3
    for order in orders:
        held = [NAMES[index] for index in order]
        assert sorted(held) == sorted(NAMES)
        assert sorted(held[:2]) == sorted(next_lift.FAMILIAR)
        assert held[2] == next_lift.ODD


def test_who_would_stop_goes_on_and_the_data_say_so(shipped):
    stopped = shipped.data.stopped.values.astype(int)
    assert stopped.shape == (3, 2, 5)
    assert (np.diff(stopped, axis=-1) >= 0).all()
    assert set(stopped.ravel()) == {0, 1}


def test_rows_are_those_of_the_familiar_rods_and_of_what_was_free(shipped):
    rows = shipped.lifts[(shipped.lifts["observer"] == 1) & (shipped.lifts["learner"] == "density")]
    assert rows["block"].tolist() == ["familiar"] * 2 + ["free"] * 5
    assert rows["object"].tolist() == [NAMES[index] for index in shipped.data.object.sel(learner="density").values[1]]


def test_numbers_of_made_up_orders_by_hand():
    """One observer lifts the third rod of steel look next and stops after three; the other lifts brass first."""
    familiar = [*map(NAMES.index, next_lift.FAMILIAR)]
    like, odd, *brass = map(NAMES.index, (next_lift.LIKE_IT, next_lift.ODD, *next_lift.BRASS))
    (other,) = {*range(len(NAMES))} - {*familiar, like, odd, *brass}
    data = xr.Dataset(
        {
            "object": (
                ("observer", "trial"),
                [[*familiar, odd, like, other, *brass], [*familiar, odd, *brass, like, other]],
            ),
            "stopped": (("observer", "free"), [[False, False, False, True, True], [False] * 5]),
        }
    )
    found = next_lift.summarise(next_lift.measure(data, THINGS))
    assert (found["place_of_like"], found["like_next"], found["place_of_brass"]) == (3.0, 0.5, 3.5)
    assert found["stopped"].tolist() == [0.0, 0.0, 0.0, 0.5, 0.5]
    assert (found["lifts_until_stop"], found["lifts_median"]) == (4.0, 4.0)


def feel(parts, memory, densities):
    """The memory after one hold at rest."""
    settings = DEFAULT_SETTINGS
    belief = predict_object(parts, memory, settings.prior)
    statistics = StaticHold(load_arm()).measure(belief, np.array(densities), settings.noise, (3,))
    posterior, _ = condition_on_torques(belief, statistics, 7, settings.noise, settings.prior.deviation)
    return posterior.memory


def list_felt(things, memory):
    return next_lift.list_felt(things, memory, DEFAULT_SETTINGS.prior)


@pytest.mark.parametrize("learner", LEARNERS.values())
def test_what_several_holds_of_an_object_tell_adds_up(learner):
    memory, felt = start_memory(learner), []
    for _ in range(2):
        memory = feel(measure_drawing(ROD), memory, [7850.0])
        felt.append(list_felt(THINGS, memory))
    assert ROD.name in felt[0]
    assert list(felt[0]) == list(felt[1])
    once, twice = (each[ROD.name] for each in felt)
    np.testing.assert_allclose(twice.own.precision, 2.0 * once.own.precision, rtol=0.05)  # errors grow with torque
    assert once.shared.precision < twice.shared.precision < 2.0 * once.shared.precision


def test_objects_that_look_alike_have_told_once():
    memory = feel(measure_drawing(ROD), MaterialMemory(), [7850.0])
    assert list(list_felt((ROD, replace(ROD, name="twin")), memory)) == [ROD.name]


def test_parts_of_one_material_tell_once_however_their_colours_were_measured():
    (part,) = measure_drawing(ROD)
    red, green, blue = part.colour
    parts = [replace(part, colour=(red, green, blue + shift), colour_sd=2.0) for shift in (0.0, 0.005)]
    memory = feel(parts, MaterialMemory(), [900.0])
    felt = memory.recall([each.appearance for each in parts], DEFAULT_SETTINGS.prior).felt
    assert felt is not None
    assert felt.colours == memory.colours == (part.colour,)
    assert felt.own.precision.shape == (1, 1)


def test_seed_decides_what_is_chosen(monkeypatch):
    monkeypatch.setattr(next_lift, "SAMPLES", 100)
    memory = feel(measure_drawing(ROD), MaterialMemory(), [7850.0])
    seeds = (0, 0, next_lift.Stream.CHOSEN, 1)
    one, again = (next_lift.choose(THINGS[2:], THINGS, memory, Setup(), seeds) for _ in range(2))
    assert one == again
