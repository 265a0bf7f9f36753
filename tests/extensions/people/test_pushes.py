"""Tables of lifts: people, objects that are made from their rows, and refusals."""

import argparse

import numpy as np
import pytest
from helpers.refusals import refuse

from affordance.commands.arguments import add_out
from affordance.commands.people.arguments import add_fit_options
from affordance.commands.people.people_options import read_setting
from affordance.experiments.shared.holds import compute_volume
from affordance.extensions.people.experiments.lifts import cylinder
from affordance.extensions.people.pushes import read_lifts
from affordance.objects.materials import MATERIALS, load_materials

TABLE = """participant,object,mass,size,force,teaches,learner,looks_like
P1,a,0.5,0.0004,4.5,yes,people,
P1,b,0.9,0.0006,,no,people,#aa3311
P2,a,0.5,0.0004,5.5,yes,people,
P2,a,0.7,0.0004,6.5,yes,people,
P2,a,0.7,0.0004,7.5,yes,density,
"""


def write(tmp_path, text=TABLE):
    path = tmp_path / "lifts.csv"
    path.write_text(text)
    return path


def test_people_and_objects_are_those_of_the_rows(tmp_path):
    found = read_lifts(write(tmp_path))
    assert [person.name for person in found.people] == ["P1", "P2"]
    assert [tool.name for tool in found.tools] == ["a", "b", "a"]
    np.testing.assert_allclose([tool.mass for tool in found.tools], [0.5, 0.9, 0.7])
    np.testing.assert_allclose([compute_volume(tool) for tool in found.tools], [0.0004, 0.0006, 0.0004])
    first, second = found.people
    assert first.objects.tolist() == [0, 1]
    assert first.teaches.tolist() == [True, False]
    assert np.isnan(first.pushes).tolist() == [False, True]
    assert (second.objects.tolist(), second.pushes.tolist()) == ([0, 2], [5.5, 6.5])
    looks = [tool.components[0].looks_like.colour for tool in found.tools]
    assert looks[0] == looks[2] != looks[1]


def test_columns_may_have_other_names(tmp_path):
    other = write(tmp_path, TABLE.replace("participant", "subject").replace("force", "push"))
    found = read_lifts(other, columns={"participant": "subject", "force": "push"})
    assert [person.name for person in found.people] == ["P1", "P2"]
    said = refuse(read_lifts, other, columns={"participnt": "subject"})
    assert "--columns: is 'participnt', must be one of participant, " in said
    questions = argparse.ArgumentParser()
    add_fit_options(questions)
    add_out(questions)
    words = ["--out", str(tmp_path), str(other), "--columns", "participant=subject", "force=push"]
    _, of_command = read_setting(questions.parse_args(words))
    assert str(of_command.people) == str(found.people)


def test_lifts_of_a_learner_are_those_that_are_asked_for(tmp_path):
    found = read_lifts(write(tmp_path), learner="density")
    assert [person.pushes.tolist() for person in found.people] == [[7.5]]
    only = read_lifts(write(tmp_path, "observer,object,mass,size,force\n0,a,0.5,0.0004,4\n1,a,0.5,0.0004,5\n"))
    assert [person.name for person in only.people] == ["0", "1"]


def test_objects_can_be_given(tmp_path):
    heights = {name: size / (np.pi * 0.04**2) for name, size in (("b", 0.0006), ("a", 0.0004))}
    tools = [cylinder(name, radius=0.04, height=height, mass=0.9) for name, height in heights.items()]
    found = read_lifts(write(tmp_path), tools=tools)
    assert [tool.name for tool in found.tools] == ["a", "b", "a"]
    np.testing.assert_allclose([tool.mass for tool in found.tools], [0.5, 0.9, 0.7])


def test_given_objects_have_the_masses_and_looks_of_the_rows(tmp_path):
    """As in a table of trials; a mass that is no object's, or a size that is another's, is refused."""
    tools = [cylinder(name, radius=0.04, height=0.1, mass=0.5) for name in ("a", "b")]
    text = "object,mass,looks_like,force\na,,,5\na,1.5,,5\nb,1.5,#aa3311,5\na,,beech,5\na,1.5,,5\n"
    found = read_lifts(write(tmp_path, text), tools=tools, materials=load_materials(MATERIALS))
    assert found.people[0].objects.tolist() == [0, 1, 2, 3, 1]
    np.testing.assert_allclose([tool.mass for tool in found.tools], [0.5, 1.5, 1.5, 0.5])
    looks = [tool.components[0].looks_like for tool in found.tools]
    assert looks[0].colour == looks[1].colour == tools[0].components[0].looks_like.colour
    assert (looks[2].name, looks[3].name) == ("#aa3311", "beech")
    volume = compute_volume(tools[0])
    assert len(read_lifts(write(tmp_path, f"object,size,force\na,{volume:.4g},5\n"), tools=tools).tools) == 1
    for row, said in (
        ("object,mass,force\na,90,5\n", "row 2, mass: is 90, must be from"),
        ("object,looks_like,force\na,oka,5\n", "row 2, looks_like: is 'oka', must be"),
        ("object,size,force\na,0.001,5\n", "row 2, size: is 0.001 m^3, but that of a in the tools file is 0.0005027"),
    ):
        assert said in refuse(read_lifts, write(tmp_path, row), tools=tools)


@pytest.mark.parametrize(
    ("changed", "to", "said"),
    [
        ("0.0006", "", "row 3, size: is empty, must be its volume, in m^3; or --objects names a tools file with all"),
        ("size", "note", "row 2, size: is missing, must be its volume, in m^3; or --objects names a tools file"),
        ("0.0006", "600", "row 3, size: is 600, must be from 1e-09 to 0.1 m^3; 0.0006 if cm^3 were meant"),
        ("P1,b,0.9", "P1,b,900", "row 3, mass: is 900, must be from 0.001 to 100 kg; 0.9 if g were meant"),
        ("4.5", "-4.5", "row 2, force: is -4.5, must be from 0.001 to 1000 N"),
        ("0.0004,4.5", "0.0004,", "force: is empty in all rows of participant P1"),
        ("P1,b,0.9,0.0006", "P1,b,90,0.000001", "row 3, mass: and size make no object: density of b"),
        ("force", "weight", "force: is missing among participant, object, mass, size, weight, teaches, learner, "),
        ("force", "weight", "; --columns force=NAME names the column to use"),
        (
            "participant",
            "subject",
            "did you mean 'participant'? Then name it so, or say --columns participant=subject",
        ),
        ("people", "kinds_map", "learner: has kinds_map, density; --of says whose lifts are meant"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(tmp_path, changed, to, said):
    assert said in refuse(read_lifts, write(tmp_path, TABLE.replace(changed, to)))
