"""Observers who choose what they hold next: their choices, the trials at which they would stop, and bad input."""

import re
from dataclasses import replace

import numpy as np
import pytest
import yaml
from helpers.children import ROOT
from helpers.short_holds import choose_for_one_tool
from helpers.stacked import stack

from affordance.belief.kind_memory import start_memory
from affordance.belief.learner import Learner
from affordance.belief.material_memory import MaterialMemory
from affordance.experiments.protocol_runs import load_hold_experiment, load_protocol_experiment
from affordance.plant.load import load_arm
from affordance.proprioception.estimator import condition_on_torques
from affordance.proprioception.static_hold import StaticHold
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.eye import measure_drawing
from affordance.vision.systems import predict_object


@pytest.fixture(scope="module")
def lived():
    """Two observers with one density a colour."""
    experiment = choose_for_one_tool(load_hold_experiment("next_lift").with_learners([Learner.DENSITY]))
    return experiment, [experiment.run_learner(None, repeat) for repeat in range(2)]


def test_each_object_is_held_once_the_odd_one_first_then_what_looks_like_it(lived):
    _, observers = lived
    for arrays in observers:
        assert sorted(arrays["presented"]) == [2, 3, 4, 5, 6]
        assert arrays["presented"][:2].tolist() == [2, 3]
        assert set(arrays["presented"][3:]) == {5, 6}  # brass, of which no tool is made


def test_who_would_stop_goes_on_as_told_and_the_measure_says_so(lived):
    _, observers = lived
    for arrays in observers:
        assert set(arrays["stopped"]) == {0.0, 1.0}
        assert np.all(np.diff(arrays["stopped"]) >= 0.0)


def test_holding_still_is_a_task_that_holds_are_worth_something_for(lived):
    """Work would be zero whatever is chosen, so that nothing would be worth holding."""
    experiment, _ = lived
    chooser = replace(experiment.means.chooser, tasks={0: ("hold",)})
    _, is_over = chooser.choose(0, chooser.objects, MaterialMemory(), DEFAULT_SETTINGS, (0,))
    assert not is_over


def test_numbers_are_those_of_the_order_that_was_chosen(lived):
    experiment, observers = lived
    stacked = stack(observers)
    numbers = experiment.compute_metrics(None, None, stacked)
    assert (numbers["place_of_like"], numbers["like_next"]) == (2.0, 1.0)
    assert numbers["place_of_brass"] == 4.5
    assert numbers["lifts_until_stop"] == pytest.approx(np.mean(np.sum(1.0 - stacked["stopped"], axis=1)))


def test_experience_is_shared_and_leaves_what_was_felt(lived, tmp_path):
    """Shared experience gives the arrays of an observer who lived it, errors of measurement included, to 1e-9.

    Beliefs begin after the experience instead of before it.
    """
    experiment, observers = lived
    experience = experiment.gain_experience(tmp_path, repeats=1, jobs=1)
    assert experience is not None
    arrays = experiment.run_learner(experience, 0)
    moments = ("density_mode", "density_quantiles")
    for name, values in observers[0].items():
        if name != "densities":
            begin = int(name in moments)
            np.testing.assert_allclose(arrays[name][begin:], values[begin:], rtol=1e-9, err_msg=name)


def feel(parts, memory, settings, densities):
    """The memory after one hold at rest."""
    static = StaticHold(load_arm(settings.arm))
    belief = predict_object(parts, memory, settings.prior)
    statistics = static.measure(belief, np.array(densities), settings.noise, (3,))
    posterior, _ = condition_on_torques(belief, statistics, 7, settings.noise, settings.prior.deviation_sd)
    return posterior.memory


@pytest.mark.parametrize("learner", Learner)
def test_what_several_holds_of_an_object_tell_adds_up(lived, learner):
    experiment, _ = lived
    settings, chooser = experiment.settings, experiment.means.chooser
    rod, *_ = chooser.objects
    memory, felt = start_memory(learner), []
    for _ in range(2):
        memory = feel(measure_drawing(rod), memory, settings, [7850.0])
        felt.append(chooser.list_felt(memory, settings.prior))
    assert list(felt[0]) == list(felt[1]) == [rod.name]
    once, twice = (each[rod.name] for each in felt)
    np.testing.assert_allclose(twice.own.precision, 2.0 * once.own.precision, rtol=0.05)  # errors grow with torque
    assert once.shared.precision < twice.shared.precision < 2.0 * once.shared.precision


def test_objects_that_look_alike_have_told_once(lived):
    experiment, _ = lived
    settings, chooser = experiment.settings, experiment.means.chooser
    rod, *_ = chooser.objects
    twins = replace(chooser, objects=(rod, replace(rod, name="twin")))
    memory = feel(measure_drawing(rod), MaterialMemory(), settings, [7850.0])
    assert list(twins.list_felt(memory, settings.prior)) == [rod.name]


def test_parts_of_one_material_tell_once_however_their_colours_were_measured(lived):
    experiment, _ = lived
    settings = experiment.settings
    (part,) = measure_drawing(experiment.tools[0])
    red, green, blue = part.colour
    parts = [replace(part, colour=(red, green, blue + shift), colour_sd=2.0) for shift in (0.0, 0.005)]
    memory = feel(parts, MaterialMemory(), settings, [900.0])
    felt = memory.recall([each.appearance for each in parts], settings.prior).felt
    assert felt is not None
    assert felt.colours == memory.colours == (part.colour,)
    assert felt.own.precision.shape == (1, 1)


def test_the_same_seed_gives_the_same_choices(lived):
    experiment, observers = lived
    again = experiment.run_learner(None, 0)
    np.testing.assert_array_equal(again["presented"], observers[0]["presented"])


def test_example_in_the_documentation_gives_the_numbers_below_it(tmp_path):
    page = (ROOT / "docs" / "protocols.md").read_text(encoding="utf-8")
    ((example, said),) = re.findall(r"```yaml\n(name: .*?)```\n\n```text\n(.*?)```", page, re.DOTALL)
    path = tmp_path / "pick_next.yaml"
    path.write_text(example, encoding="utf-8")
    experiment = load_protocol_experiment(str(path))
    numbers = experiment.compute_metrics(None, None, stack([experiment.run_learner(None, k) for k in range(4)]))
    assert {name: np.asarray(numbers[name]).tolist() for name in ("place_of_brass", "stopped")} == yaml.safe_load(
        said
    )
