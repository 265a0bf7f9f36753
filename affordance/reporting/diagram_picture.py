"""Draws the block diagram of a Drake Diagram, arranged like the paper's figure 2.

Systems, ports and connections are read from the Diagram; only grouping and style are added. Unconnected ports are
omitted, because a plant has dozens of them, and so are loggers.
"""

import html
from collections import defaultdict
from pathlib import Path

from pydrake.systems.framework import Diagram

from affordance.drake.system_libraries import hide_font_warnings
from affordance.exceptions import UnavailableError
from affordance.files.atomic import write_atomic, write_text

# Groups in the paper's figure 2. Systems with other names belong to the world.
_GROUPS = {
    "Visual system": ("#dbe9f6", {"feature_sensor", "material_memory", "visual_prior"}),
    "Proprioceptive system": ("#e3f1e0", {"proprioception", "density_estimator"}),
    "Control system": ("#fbe8d3", {"task", "mpc_controller"}),
    "World": ("#eeeeee", set[str]()),
}
# Teaching signal: the posterior of a trial becomes the prior of the next trial.
_TEACHING_SIGNAL = ("density_estimator", "posterior", "material_memory", "posterior")
_LOGGER = "_log"  # end of a logger's name
_LEGEND = "blue: the teaching signal, once at the end of a trial"
# Connections that the layout ignores, because they oppose the flow from vision through control to proprioception.
_FEEDBACK = {_TEACHING_SIGNAL[::2], ("plant", "mpc_controller"), ("scene_graph", "plant")}


def describe_diagram(diagram: Diagram) -> str:
    """Describes a Diagram in the DOT language. The same Diagram always gives the same text."""
    shown = (system for system in diagram.GetSystems() if not system.get_name().endswith(_LOGGER))
    systems = sorted(shown, key=lambda system: str(system.get_name()))
    inputs: dict[str, set[tuple[int, str]]] = defaultdict(set)
    outputs: dict[str, set[tuple[int, str]]] = defaultdict(set)
    edges = []
    for (to_system, to_index), (from_system, from_index) in diagram.connection_map().items():
        if to_system.get_name().endswith(_LOGGER):
            continue
        source, sink = from_system.get_output_port(from_index), to_system.get_input_port(to_index)
        outputs[from_system.get_name()].add((int(from_index), source.get_name()))
        inputs[to_system.get_name()].add((int(to_index), sink.get_name()))
        edges.append((from_system.get_name(), source.get_name(), to_system.get_name(), sink.get_name()))

    legend = [f'  label=<<FONT COLOR="#0072B2">{_LEGEND}</FONT>>; labelloc=b;'] if _TEACHING_SIGNAL in edges else []
    lines = [
        f'digraph "{diagram.get_name()}" {{',
        "  rankdir=LR; nodesep=0.35; ranksep=0.7; splines=spline; fontname=Helvetica;",
        *legend,
        "  node [shape=none, fontname=Helvetica, fontsize=12]; edge [fontname=Helvetica, fontsize=11];",
    ]
    for number, (group, (fill, _)) in enumerate(_GROUPS.items()):
        # Names are placed where no connection crosses them.
        side, height = {"World": ("l", "b"), "Proprioceptive system": ("r", "b")}.get(group, ("l", "t"))
        lines += [
            f"  subgraph cluster_{number} {{",
            f"    label=<<B>{group}</B>>; labeljust={side}; labelloc={height}; fontsize=12;",
            f'    style="rounded,filled"; color="{fill}"; fillcolor="{fill}";',
        ]
        lines += [
            f"    {name} [label=<{_describe_ports(name, inputs[name], outputs[name])}>];"
            for name in (system.get_name() for system in systems)
            if _find_group(name) == group
        ]
        lines.append("  }")
    for edge in sorted(edges):
        from_name, source_name, to_name, sink_name = edge
        style = ["constraint=false"] if (from_name, to_name) in _FEEDBACK else []
        if edge == _TEACHING_SIGNAL:
            style += ["style=bold", 'color="#0072B2"']
        ends = [f'{system}:"{_escape(port)}"' for system, port in ((from_name, source_name), (to_name, sink_name))]
        lines.append(f"  {ends[0]}:e -> {ends[1]}:w [{', '.join(style)}];")
    return "\n".join([*lines, "}"]) + "\n"


def save_diagram(diagram: Diagram, folder: Path, name: str) -> None:
    """Writes NAME.dot and NAME.svg atomically.

    Raises:
        UnavailableError: Graphviz is missing. NAME.dot has been written.
    """
    text = describe_diagram(diagram)
    write_text(folder / f"{name}.dot", text)
    try:
        import pygraphviz
    except ImportError as error:
        raise UnavailableError("pictures of Diagrams are", str(error)) from error
    with hide_font_warnings():
        write_atomic(folder / f"{name}.svg", lambda path: pygraphviz.AGraph(string=text).draw(str(path), prog="dot"))


def _escape(name: str) -> str:
    """Escapes a name for a quoted DOT string, because port names contain the names of models from files."""
    return name.replace("\\", "\\\\").replace('"', '\\"')


def _find_group(name: str) -> str:
    return next((group for group, (_, names) in _GROUPS.items() if name in names), "World")


def _describe_ports(name: str, inputs: set[tuple[int, str]], outputs: set[tuple[int, str]]) -> str:
    """Builds an HTML table of a system's name, its connected inputs on the left and its outputs on the right."""
    left = [port for _, port in sorted(inputs)]
    right = [port for _, port in sorted(outputs)]
    rows = [f'<TR><TD COLSPAN="2" BGCOLOR="white"><B>{html.escape(name)}</B></TD></TR>']
    for row in range(max(len(left), len(right), 1)):
        cells = "".join(
            f'<TD BGCOLOR="white" PORT="{html.escape(ports[row])}">{html.escape(ports[row])}</TD>'
            if row < len(ports)
            else '<TD BORDER="0"></TD>'
            for ports in (left, right)
        )
        rows.append(f"<TR>{cells}</TR>")
    return f'<TABLE BORDER="0" CELLBORDER="1" CELLSPACING="0" CELLPADDING="4">{"".join(rows)}</TABLE>'
