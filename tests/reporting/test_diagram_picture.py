"""Diagrams as pictures: names of ports, which may come from a stranger's models, are shown as text."""

import pytest
from pydrake.common.value import Value
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from affordance.reporting.diagram_picture import describe_diagram, save_diagram

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
