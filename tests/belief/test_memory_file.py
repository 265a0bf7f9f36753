"""A memory comes back from its file to the last bit, and learns on as if it had never been written."""

import json
from dataclasses import replace

import numpy as np
import pytest
from affordance.belief.kind_memory import KindMemory
from helpers.refusals import refuse

from affordance.belief.density_belief import Prior
from affordance.belief.kinds_gate import GateSettings, KindSettings
from affordance.belief.learner import Pick
from affordance.belief.likelihood import Likelihood
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.memory_file import format_memory, parse_memory
from affordance.objects.appearance import PartAppearance

PRIOR = Prior(mode=1000.0, sd=4000.0, deviation_sd=100.0)
BRASS, STEEL = (0.8, 0.6, 0.1), (0.5, 0.5, 0.6)


def lift(memory, colours, length, densities):
    parts = [PartAppearance(colour, (length, 0.02), (length * k, 0.0, 0.0)) for k, colour in enumerate(colours)]
    recollection = memory.recall(parts, PRIOR)
    precision = np.eye(len(colours)) / 150.0**2
    likelihood = Likelihood(precision, precision @ np.array(densities), -0.5 * float(np.dot(densities, densities)))
    return recollection.memory.learn(recollection.densities, lambda belief: likelihood, PRIOR.deviation_sd).memory


def learn_from_an_odd_rod(memory):
    for _ in range(3):
        memory = lift(memory, [BRASS], 0.05, [5000.0])
        memory = lift(memory, [BRASS, STEEL], 0.1, [5100.0, 3000.0])
        memory = lift(memory, [BRASS], 0.08, [12000.0])
    return memory


@pytest.mark.parametrize("pick", Pick)
def test_memory_comes_back_to_the_last_bit(pick):
    start = KindMemory(KindSettings(GateSettings(0.25), pick, (3, 1)))
    memory = learn_from_an_odd_rod(start)
    again = parse_memory(format_memory(memory))
    assert any(known.own.columns for known in memory.kinds.objects)  # there are own densities that have to come back
    assert (again.settings, again.colours, again.num_lifts) == (memory.settings, memory.colours, memory.num_lifts)
    assert again.kinds.colours == memory.kinds.colours
    for one, other in zip(again.kinds.objects, memory.kinds.objects, strict=True):
        assert one.appearance == other.appearance
        assert (one.colours, one.memberships, one.own.columns) == (
            other.colours,
            other.memberships,
            other.own.columns,
        )
        np.testing.assert_array_equal(one.own.belief.precision, other.own.belief.precision)
    on, further = (learn_from_an_odd_rod(each) for each in (again, memory))
    np.testing.assert_array_equal(on.kinds.belief.precision, further.kinds.belief.precision)
    np.testing.assert_array_equal(on.kinds.belief.information_vector, further.kinds.belief.information_vector)


def test_a_memory_before_anything_was_met_comes_back():
    start = KindMemory(KindSettings(GateSettings(0.25)))
    again = parse_memory(format_memory(start).encode())
    assert (again.colours, again.kinds.objects, again.belief.size) == ((), (), 0)


def test_text_is_json_without_what_was_only_recalled():
    start = KindMemory(KindSettings(GateSettings(0.25)))
    recalled = start.recall([PartAppearance(BRASS, (0.1, 0.02), (0.0, 0.0, 0.0))], PRIOR).memory
    content = json.loads(format_memory(recalled))
    assert content["objects"] == []
    assert content["colours"] == [list(BRASS)]


def test_memory_of_one_density_for_each_colour_comes_back_too():
    memory = lift(MaterialMemory(), [BRASS, STEEL], 0.1, [8000.0, 7800.0])
    again, without = (parse_memory(format_memory(each)) for each in (memory, replace(memory, objects=())))
    assert again.colours == memory.colours
    further, on, anew = (lift(each, [BRASS, STEEL], 0.1, [8000.0, 7800.0]) for each in (memory, again, without))
    np.testing.assert_array_equal(on.belief.precision, further.belief.precision)
    assert not np.allclose(anew.belief.precision, further.belief.precision)  # the objects have to come back too
    np.testing.assert_array_equal(again.belief.precision, memory.belief.precision)
    np.testing.assert_array_equal(again.belief.information_vector, memory.belief.information_vector)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "memory: is not JSON"),
        ("[]", "memory: is not a memory of materials"),
        ("3", "memory: is not a memory of materials"),
        ('{"gate": 1}', "memory: is not a memory of materials"),
        ('{"colours": [[1, 2]]}', "memory: is not a memory of materials"),
        ('{"gate": {"kappa": 0.2}}', "memory: is not a memory of materials"),
    ],
)
def test_text_that_is_no_memory_is_refused(text, said):
    assert said in refuse(parse_memory, text)
