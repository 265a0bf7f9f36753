import dataclasses

import numpy as np
import pytest

from affordance.belief.material_memory import MaterialMemory
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_materials, load_tools
from affordance.simulation.clamp_trial import run_clamp_and_release, tabulate_excursions
from studies.people.linear_plus import GROUPS, build_experiment

DURATION = 0.6


@pytest.fixture(scope="module")
def table(runner):
    return tabulate_excursions(runner, build_experiment(GROUPS[1]).tools[-1], duration=DURATION)


@pytest.mark.parametrize("factor", [0.55, 0.85, 1.15])
def test_excursions_between_are_those_of_the_simulation(runner, table, factor):
    tool = build_experiment(GROUPS[1]).tools[-1]
    (part,) = tool.components
    memory = MaterialMemory.from_densities({part.looks_like.colour: factor * part.material.density})
    _, clamp = run_clamp_and_release(runner, tool, memory, duration=DURATION, seed=(0,))
    assert table.interpolate(np.array([clamp.force]))[0] == pytest.approx(clamp.excursion, rel=0.01)


def test_hand_rises_the_higher_the_more_it_pushed(table):
    assert (np.diff(table.excursion) > 0.0).all()
    assert table.excursion[0] < 0.0 < table.excursion[-1]


def test_forces_outside_the_table_are_errors(table):
    with pytest.raises(ValueError, match=r"forces are from 1 to 9 N, must be from 4\.41"):
        table.interpolate(np.array([1.0, 9.0]))


def test_objects_of_two_colours_are_errors(runner):
    tool = load_tools(MODELS / "tools" / "com.yaml", load_materials(MODELS / "materials.yaml"))[0]
    with pytest.raises(ValueError, match=f"{tool.name} shows 2 colours, must show one"):
        tabulate_excursions(runner, dataclasses.replace(tool), duration=DURATION)
