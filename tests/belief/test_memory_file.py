"""A memory comes back from its file to the last bit, and learns on as if it had never been written."""

import json

import numpy as np
import pytest
from helpers.refusals import refuse

from affordance.belief.density_belief import Prior
from affordance.belief.holds import Felt
from affordance.belief.kinds_learner import Kinds, Pick
from affordance.belief.learners import DENSITY, LEARNERS
from affordance.belief.likelihood import Likelihood
from affordance.belief.material_memory import MaterialMemory, start_memory
from affordance.belief.memory_file import format_memory, parse_memory
from affordance.objects.appearance import PartAppearance

PRIOR = Prior(mode=1000.0, sd=4000.0, deviation=0.06)
BRASS, STEEL = (0.8, 0.6, 0.1), (0.5, 0.5, 0.6)
HEAD = '{"learner": "density", "seed": [0], "colours": [], "things": [], "num_lifts": 0'


def lift(memory, colours, length, densities):
    parts = [PartAppearance(colour, (length, 0.02), (length * k, 0.0, 0.0)) for k, colour in enumerate(colours)]
    recollection = memory.recall(parts, PRIOR)
    precision = np.eye(len(colours)) / 150.0**2
    likelihood = Likelihood(precision, precision @ np.array(densities), -0.5 * float(np.dot(densities, densities)))
    return recollection.memory.learn(Felt.from_quadratic(likelihood), PRIOR.deviation).memory


def learn_from_an_odd_rod(memory):
    for _ in range(3):
        memory = lift(memory, [BRASS], 0.05, [5000.0])
        memory = lift(memory, [BRASS, STEEL], 0.1, [5100.0, 3000.0])
        memory = lift(memory, [BRASS], 0.08, [12000.0])
    return memory


@pytest.mark.parametrize("learner", [*LEARNERS.values(), *(Kinds(pick, kappa=0.25) for pick in Pick)])
def test_memory_comes_back_to_the_last_bit(learner):
    memory = learn_from_an_odd_rod(start_memory(learner, (3, 1)))
    again = parse_memory(format_memory(memory), learner)
    for name in ("learner", "seed", "colours", "things", "num_lifts", "at_hand"):
        assert getattr(again, name) == getattr(memory, name)
    on, further = (learn_from_an_odd_rod(each) for each in (again, memory))
    for one, other in ((again, memory), (on, further)):
        assert one.state.keys() == other.state.keys()
        for name, array in one.state.items():
            np.testing.assert_array_equal(array, other.state[name])
            assert array.dtype == other.state[name].dtype


def test_what_was_felt_of_an_odd_thing_comes_back_too():
    memory = learn_from_an_odd_rod(start_memory(Kinds(kappa=0.25)))
    assert memory.state["is_own"].any()
    assert memory.state["hold_count"].any()


def test_a_memory_before_anything_was_met_comes_back():
    again = parse_memory(format_memory(start_memory("kinds_map")).encode(), LEARNERS["kinds_map"])
    assert (again.colours, again.things, again.belief.size) == ((), (), 0)


def test_text_is_json_without_what_was_only_recalled():
    recalled = MaterialMemory().recall([PartAppearance(BRASS, (0.1, 0.02), (0.0, 0.0, 0.0))], PRIOR).memory
    content = json.loads(format_memory(recalled))
    assert content["things"] == []
    assert content["colours"] == [list(BRASS)]
    assert parse_memory(json.dumps(content), DENSITY).at_hand is None


def test_memory_of_another_learner_is_named_in_a_line():
    text = format_memory(lift(start_memory("kinds_map"), [BRASS], 0.1, [8000.0]))
    assert refuse(parse_memory, text, DENSITY) == (
        "memory: learner: is 'kinds_map', must be 'density', the learner that reads the memory"
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "memory: is not a memory of materials"),
        ("[]", "memory: is not a memory of materials"),
        ("3", "memory: is not a memory of materials"),
        ('{"gate": 1}', "memory: is not a memory of materials"),
        ('{"colours": [[1, 2]]}', "memory: is not a memory of materials"),
        ('{"learner": "density"}', "memory: is not a memory of materials"),
        (f'{HEAD}, "state": {{"a": {{"type": "object", "shape": [], "values": 1}}}}}}', "has the type 'object'"),
        (f'{HEAD}, "state": {{"a": {{"type": "int64", "shape": [9], "values": [1]}}}}}}', "reshape"),
        (f'{HEAD}, "state": {{"a": {{"type": "int64", "shape": [1], "values": [1e99]}}}}}}', "memory:"),
    ],
)
def test_text_that_is_no_memory_is_refused(text, said):
    assert said in refuse(parse_memory, text, DENSITY)
