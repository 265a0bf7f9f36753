import dataclasses
import re
from pathlib import Path

import pygraphviz
import pytest

from affordance.diagram import build_trial_diagram
from affordance.diagram_picture import describe_diagram, save_diagram

DIAGRAMS = Path(__file__).parents[1] / "diagrams"


@pytest.fixture
def trial(runner, weight_config):
    return runner.get_diagram(weight_config.tools[0])


def list_connections(diagram):
    return {
        (source.get_name(), source.get_output_port(i).get_name(), sink.get_name(), sink.get_input_port(j).get_name())
        for (sink, j), (source, i) in diagram.connection_map().items()
    }


def test_diagram_is_wired_as_the_design_says(trial):
    assert list_connections(trial.diagram) >= {
        ("material_memory", "materials", "visual_prior", "materials"),
        ("vision", "features", "visual_prior", "features"),
        ("visual_prior", "prior", "density_estimator", "prior"),
        ("visual_prior", "prior", "mpc_controller", "belief"),
        ("density_estimator", "posterior", "material_memory", "posterior"),
        ("task", "goal", "mpc_controller", "goal"),
        ("plant", "state", "mpc_controller", "state"),
        ("mpc_controller", "tau", "plant", "actuation"),
        ("plant", "net_actuation", "proprioception", "tau"),
        ("proprioception", "sensation", "density_estimator", "sensation"),
    }


def test_every_system_and_port_has_a_name_of_its_own(trial):
    names = [system.get_name() for system in trial.diagram.GetSystems()]
    assert all(re.fullmatch(r"[a-z]+(_[a-z]+)*", name) for name in names)
    assert len(set(names)) == len(names)
    for connection in list_connections(trial.diagram):
        assert not any(re.fullmatch(r"[uy]\d+", name) for name in connection)


def test_plant_is_continuous(trial):
    assert trial.arm.plant.time_step() == 0.0


def test_belief_of_the_controller_is_another_connection(weight_config):
    settings = dataclasses.replace(weight_config.settings, uses_posterior=True)
    connections = list_connections(build_trial_diagram(weight_config.tools[0], settings).diagram)
    assert ("density_estimator", "posterior", "mpc_controller", "belief") in connections
    assert ("visual_prior", "prior", "mpc_controller", "belief") not in connections


def test_committed_picture_is_up_to_date(trial):
    """If this fails: make diagrams, look at the picture, commit it."""
    assert (DIAGRAMS / "weight.dot").read_text() == describe_diagram(trial.diagram)
    picture = (DIAGRAMS / "weight.svg").read_text()
    for name in (system.get_name() for system in trial.diagram.GetSystems()):
        assert f">{name}<" in picture


def test_picture_shows_every_system_and_connection(trial, tmp_path):
    save_diagram(trial.diagram, tmp_path, "diagram")
    graph = pygraphviz.AGraph(string=(tmp_path / "diagram.dot").read_text())
    assert set(graph.nodes()) == {system.get_name() for system in trial.diagram.GetSystems()}
    assert len(graph.edges()) == len({(a, c) for a, _, c, _ in list_connections(trial.diagram)}) or len(
        graph.edges()
    ) == len(list_connections(trial.diagram))
    assert (tmp_path / "diagram.svg").read_text().startswith("<?xml")
