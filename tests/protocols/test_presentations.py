import itertools
from pathlib import Path

import numpy as np
import pytest
from helpers.refusals import refuse
from pydrake.multibody.tree import SpatialInertia

from affordance.protocols.block_entries import BlockEntry
from affordance.protocols.object_entries import CylinderEntry, ProtocolObjects
from affordance.protocols.presentations import build_row, check_blocks, count_rows, draw_presentations, weigh

TOOLS = tuple(
    CylinderEntry(name=name, radius=0.04, height=0.1, mass=mass, colour="#808080").build()
    for name, mass in (("a", 0.5), ("b", 0.6), ("c", 0.7), ("test", 1.0))
)
OBJECTS = ProtocolObjects(TOOLS, {"all": [0, 1, 2, 3], "family": [0, 1, 2], "test": [3]}, None)


def draw(repeat=0, **changes):
    block = BlockEntry.model_validate({"name": "x", "do": {"hold": {}}, **changes})
    rng = np.random.default_rng(repeat)
    return draw_presentations(block, 1, OBJECTS, rng, repeat)


def list_tools(**changes):
    return [presentation.tool for presentation in draw(**changes)]


def test_fixed_order_repeats_objects_as_listed():
    assert list_tools(objects="family", repetitions=2, times=2) == [0, 0, 1, 1, 2, 2] * 2


def test_shuffled_block_holds_each_object_once_a_repetition():
    drawn = list_tools(repetitions=30, order="shuffled")
    cycles = [tuple(drawn[k : k + 4]) for k in range(0, 120, 4)]
    assert all(sorted(cycle) == [0, 1, 2, 3] for cycle in cycles)
    assert len(set(cycles)) > 10


def test_test_object_comes_first_in_each_cycle():
    drawn = list_tools(repetitions=20, order="shuffled", first="test")
    assert drawn[::4] == [3] * 20
    assert len({tuple(drawn[k + 1 : k + 4]) for k in range(0, 80, 4)}) > 3


def test_block_that_would_fill_the_memory_is_one_line():
    blocks = [BlockEntry.model_validate({"name": name, "do": {"look": {}}, "repetitions": 1000}) for name in "abcdef"]
    check_blocks(Path("mine.yaml"), blocks[:5], OBJECTS)
    said = refuse(check_blocks, Path("mine.yaml"), blocks, OBJECTS)
    assert said == "mine.yaml: blocks: present 24000 objects in all, must present at most 20000"


def test_cylinder_turns_like_one():
    """Inertial parameters are those of Drake's cylinder about the middle by which it is held, to 1e-12."""
    tool = CylinderEntry(name="can", radius=0.04, height=0.1, mass=0.5, colour="#808080").build()
    expected = SpatialInertia.SolidCylinderWithMass(0.5, 0.04, 0.1, np.array([0.0, 0.0, 1.0]))
    moments = expected.CalcRotationalInertia().get_moments()
    np.testing.assert_allclose(tool.parameters, [0.5, 0.0, 0.0, 0.0, *moments, 0.0, 0.0, 0.0], rtol=1e-12, atol=1e-18)


def build_latin_square(count):
    return [build_row(count, row) for row in range(count_rows(count))]


@pytest.mark.parametrize("count", [2, 3, 4, 5, 6])
def test_latin_square_balances_places_and_successors(count):
    rows = np.array(build_latin_square(count))
    for column in rows.T:
        assert set(np.bincount(column, minlength=count)) == {len(rows) // count}
    pairs = [pair for row in rows for pair in itertools.pairwise(row)]
    assert len({pairs.count(pair) for pair in set(pairs)}) == 1
    assert len(set(pairs)) == count * (count - 1)


def test_observers_have_rows_of_the_square():
    rows = {tuple(list_tools(order="latin square", repeat=repeat)) for repeat in range(8)}
    assert rows == {tuple(row) for row in build_latin_square(4)}


def test_weight_changes_gradually_and_of_one_object_only():
    gradual = {"object": "b", "mass_from": 0.6, "mass_to": 1.0}
    drawn = draw(objects="family", repetitions=5, gradual=gradual)
    np.testing.assert_allclose([each.mass for each in drawn if each.tool == 1], [0.6, 0.7, 0.8, 0.9, 1.0])
    assert {each.mass for each in drawn if each.tool != 1} == {None}
    assert weigh(TOOLS[1], 1.0).mass == pytest.approx(1.0, rel=1e-12)
    assert weigh(TOOLS[1], 1.0).appearance == TOOLS[1].appearance


def test_where_all_come_first_nothing_is_left_to_be_ordered():
    assert list_tools(objects="test", first="test", order="latin square", repetitions=2) == [3, 3]
