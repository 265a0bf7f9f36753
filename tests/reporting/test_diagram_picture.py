"""Diagrams as pictures: names of ports, which may come from a stranger's models, are shown as text."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from affordance.drake.system_libraries import hide_font_warnings
from affordance.reporting.diagram_picture import describe_diagram, save_diagram
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.diagram import TrialDiagram

HOSTILE = ("<script>alert(1)</script>", 'a"]; b [label="\\"', "</TD></TABLE>>")


class Source(LeafSystem):
    """System that outputs a text at a port of any name."""

    def __init__(self, name):
        super().__init__()
        self.DeclareAbstractOutputPort(name, lambda: Value("x"), lambda context, output: output.set_value("x"))


class Sink(LeafSystem):
    """System that takes a text as input."""

    def __init__(self, name):
        super().__init__()
        self.DeclareAbstractInputPort(name, Value("x"))


def build(name):
    builder = DiagramBuilder()
    source, sink = builder.AddNamedSystem("source", Source(name)), builder.AddNamedSystem("sink", Sink(name))
    builder.Connect(source.get_output_port(), sink.get_input_port())
    return builder.Build()


@pytest.mark.parametrize("name", HOSTILE)
def test_names_of_ports_are_shown_as_they_are(tmp_path, name):
    pytest.importorskip("pygraphviz")
    save_diagram(build(name), tmp_path, "diagram")
    picture = (tmp_path / "diagram.svg").read_text(encoding="utf-8")
    assert "<script" not in picture
    assert picture.count('class="edge"') == 1
    assert picture.count('class="node"') == 2


def test_ordinary_names_are_written_as_before():
    assert '  source:"state":e -> sink:"state":w [];' in describe_diagram(build("state"))


def test_legend_explains_the_teaching_signal_only_where_it_is_drawn():
    assert "teaching signal" not in describe_diagram(build("state"))
    trial = TrialDiagram(DEFAULT_SETTINGS)
    assert "teaching signal" in describe_diagram(trial.diagram)


def test_no_connection_crosses_the_name_of_a_group():
    """Points along every connection of the Diagram of an experiment are outside the boxes of the groups' names."""
    pygraphviz = pytest.importorskip("pygraphviz")
    trial = TrialDiagram(DEFAULT_SETTINGS)
    graph = pygraphviz.AGraph(string=describe_diagram(trial.diagram))
    with hide_font_warnings():
        graph.layout("dot")
    shares = np.linspace(0.0, 1.0, 50)[:, None]
    points = []
    for edge in graph.edges():
        ends = np.array([pair.split(",")[-2:] for pair in edge.attr["pos"].split() if pair[0] != "e"], dtype=float)
        for first in range(0, len(ends) - 1, 3):  # cubic curves, each of which begins where the one before ends
            a, b, c, d = ends[first : first + 4]
            points.append((1 - shares) ** 3 * a + 3 * shares * (1 - shares) ** 2 * b)
            points[-1] += 3 * shares**2 * (1 - shares) * c + shares**3 * d
    names = [group.graph_attr for group in graph.subgraphs()]
    assert len(names) == 4
    for name in names:
        middle = np.array(name["lp"].split(","), dtype=float)
        half = 36.0 * np.array([float(name["lwidth"]), float(name["lheight"])])  # half of so many inches, in points
        assert not (np.abs(np.concatenate(points) - middle) < half).all(axis=1).any()
