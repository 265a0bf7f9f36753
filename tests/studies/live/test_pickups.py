"""The study of live identification in small: one pick-up by the foreign robot, in this process and over the wire."""

import re
from pathlib import Path

import numpy as np
import pytest

from affordance.extensions.payload.live import foreign_robot
from studies.live import wire
from studies.live.command import list_rows, tabulate
from studies.live.pickups import WIRE, PickupConfig, run_pickup


def test_a_pick_up_is_noticed_and_its_interval_holds_the_mass():
    pytest.importorskip("mujoco")
    found = run_pickup(PickupConfig("fr3"), 0)
    noticed, named, five_percent, _ = found["delay"]
    assert 0.0 < noticed < 2.0
    assert noticed < named < 6.0
    assert five_percent < 6.0
    number, inside = found["beliefs"]
    assert inside == number >= 6
    assert found["final"][2:].tolist() == [1.0, 1.0]
    assert abs(found["agreement"]) < 1.0
    assert found["false"] == 0
    constant = {"seconds": np.array([60.0]), "false": np.array([0.0])}
    numbers = tabulate({name: values[None] for name, values in found.items()}, constant)
    assert numbers["trusted_inside"] == 1
    assert ["90 % interval holds the mass, last belief", "1 of 1"] in list_rows(numbers)


def test_a_robot_in_another_process_is_followed_over_the_wire_and_no_sample_is_lost():
    pytest.importorskip("mujoco")
    pytest.importorskip("cyclonedds")
    found = run_pickup(PickupConfig("fr3", WIRE), 0)
    numbers = tabulate({name: values[None] for name, values in found.items()}, None)
    assert numbers["sent"] == numbers["received"] == 5700  # 22.8 s of 250 samples
    assert numbers["unused"] == numbers["false_changes"] == 0
    # A busy machine leaves out beliefs, and notices late.
    assert numbers["noticed"] == 1
    assert numbers["last_inside"] == numbers["last"]
    assert numbers["beliefs_inside"] == numbers["beliefs"]
    assert ["samples sent, received, of these not used", "5700, 5700, 0"] in list_rows(numbers)


@pytest.mark.parametrize("file", [foreign_robot.__file__, wire.__file__.replace("wire.py", "foreign_dds.py")])
def test_the_foreign_robot_imports_nothing_of_the_project(file):
    text = Path(file).read_text(encoding="utf-8")
    assert not re.search(r"^\s*(from|import) (affordance|studies)", text, re.MULTILINE)
