import dataclasses
import importlib.util
import re
from pathlib import Path
from xml.etree import ElementTree

import pygraphviz
import pytest

from affordance.reporting.diagram_picture import describe_diagram, save_diagram
from affordance.simulation.diagram import TrialDiagram

DIAGRAMS = Path(__file__).parents[2] / "diagrams"
SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture
def trial(runner, weight):
    return runner.get_diagram()


def list_connections(diagram):
    return {
        (source.get_name(), source.get_output_port(i).get_name(), sink.get_name(), sink.get_input_port(j).get_name())
        for (sink, j), (source, i) in diagram.connection_map().items()
    }


def test_diagram_is_wired_as_the_design_says(trial):
    assert list_connections(trial.diagram) >= {
        ("material_memory", "materials", "visual_prior", "materials"),
        ("feature_sensor", "features", "visual_prior", "features"),
        ("visual_prior", "prior", "density_estimator", "prior"),
        ("visual_prior", "prior", "mpc_controller", "belief"),
        ("density_estimator", "posterior", "material_memory", "posterior"),
        ("density_estimator", "p_value", "material_memory", "p_value"),
        ("task", "goal", "mpc_controller", "goal"),
        ("plant", "state", "mpc_controller", "state"),
        ("mpc_controller", "tau", "plant", "actuation"),
        ("plant", "net_actuation", "proprioception", "tau"),
        ("proprioception", "measured_tau", "density_estimator", "tau"),
        ("proprioception", "measured_state", "density_estimator", "state"),
        ("proprioception", "measured_vdot", "density_estimator", "vdot"),
    }


def test_every_system_and_port_has_a_name_of_its_own(trial):
    names = [system.get_name() for system in trial.diagram.GetSystems()]
    assert all(re.fullmatch(r"[a-z]+(_[a-z]+)*", name) for name in names)
    assert len(set(names)) == len(names)
    for connection in list_connections(trial.diagram):
        assert not any(re.fullmatch(r"[uy]\d+", name) for name in connection)


def test_belief_of_the_controller_is_another_connection(weight):
    settings = dataclasses.replace(weight.settings, uses_posterior=True)
    connections = list_connections(TrialDiagram(settings).diagram)
    assert ("density_estimator", "posterior", "mpc_controller", "belief") in connections
    assert ("visual_prior", "prior", "mpc_controller", "belief") not in connections


def list_drawn(path):
    """Groups, systems and connections of a picture, with their names, texts and colours, but without places.

    Places depend on the fonts and the version of graphviz of the machine that drew it.
    """
    drawn = []
    for element in ElementTree.parse(path).getroot().iter(f"{SVG}g"):
        texts = [text.text for text in element.findall(f"{SVG}text")]
        colours = {part.get(key) for part in element for key in ("fill", "stroke")} - {None}
        drawn.append((element.get("class"), element.findtext(f"{SVG}title"), texts, sorted(colours)))
    return sorted(drawn)


def test_committed_picture_is_up_to_date(trial, tmp_path):
    """The committed picture is up to date; else run make diagrams, look at the picture and commit it."""
    save_diagram(trial.diagram, tmp_path, "weight")
    assert (DIAGRAMS / "weight.dot").read_text(encoding="utf-8") == describe_diagram(trial.diagram)
    assert list_drawn(DIAGRAMS / "weight.svg") == list_drawn(tmp_path / "weight.svg")


def test_picture_of_the_house_is_up_to_date():
    spec = importlib.util.spec_from_file_location("redraw", DIAGRAMS / "redraw.py")
    redraw = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(redraw)
    assert (DIAGRAMS / "house.svg").read_text(encoding="utf-8") == redraw.draw_house()


def test_systems_stand_in_the_parts_of_the_papers_figure_2(trial):
    """Systems of vision, proprioception and control stand in the group of their module's folder, others in World."""
    graph = pygraphviz.AGraph(string=describe_diagram(trial.diagram))
    found = {part.graph_attr["label"]: set(part.nodes()) for part in graph.subgraphs()}
    by_folder = {"vision": "Visual", "proprioception": "Proprioceptive", "control": "Control"}
    sources = {"feature_sensor": "Visual", "task": "Control"}  # of Python objects
    expected = {f"<B>{name} system</B>": set() for name in by_folder.values()} | {"<B>World</B>": set()}
    for system in map(trial.diagram.GetSubsystemByName, list_shown(trial.diagram)[0]):
        _, folder, *_ = f"{type(system).__module__}.".split(".")
        part = by_folder.get(folder, sources.get(system.get_name()))
        expected[f"<B>{part} system</B>" if part else "<B>World</B>"].add(system.get_name())
    assert {label: nodes for label, nodes in found.items() if label} == expected


def list_shown(diagram):
    """Names of all systems but loggers, and the connections between them."""
    names = [system.get_name() for system in diagram.GetSystems() if not system.get_name().endswith("_log")]
    return names, [each for each in list_connections(diagram) if each[2] in names]


def test_description_names_every_system_and_connection_but_loggers(trial):
    graph = pygraphviz.AGraph(string=describe_diagram(trial.diagram))
    names, connections = list_shown(trial.diagram)
    assert sorted(graph.nodes()) == sorted(names)
    described = [
        (edge[0], edge.attr["tailport"].removesuffix(":e"), edge[1], edge.attr["headport"].removesuffix(":w"))
        for edge in graph.edges()
    ]
    assert sorted(described) == sorted(connections)


def test_picture_shows_every_system_its_ports_and_connections(trial, tmp_path):
    save_diagram(trial.diagram, tmp_path, "diagram")
    names, connections = list_shown(trial.diagram)
    texts = {title: sorted(texts) for kind, title, texts, _ in list_drawn(tmp_path / "diagram.svg") if kind == "node"}
    ports = {(a, b, "out") for a, b, _, _ in connections} | {(c, d, "in") for _, _, c, d in connections}
    assert texts == {name: sorted([name, *(port for owner, port, _ in ports if owner == name)]) for name in names}
    lines = sorted(title for kind, title, *_ in list_drawn(tmp_path / "diagram.svg") if kind == "edge")
    assert lines == sorted(f"{a}:e->{c}:w" for a, _, c, _ in connections)
