"""Redraws the pictures in this folder: ``make diagrams``.

The picture ``weight`` is drawn from the Diagram of an experiment, and ``house`` from the contracts of imports in
pyproject.toml.
"""

import tomllib
from pathlib import Path

from affordance.reporting.diagram_picture import save_diagram
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.diagram import TrialDiagram

HERE = Path(__file__).parent
WIDTH, HEIGHT = 640, 28  # of the house, and of one of its layers, [px]
# Groups of layers with their colours. Layers outside these groups are not drawn.
GROUPS = {
    "the program": ("#eeeeee", {"commands"}),
    "beyond the paper": ("#fbe8d3", {"extensions"}),
    "the paper": (
        "#dbe9f6",
        {
            *("experiments", "simulation", "choice", "vision", "proprioception", "control"),
            *("plant", "belief", "objects"),
        },
    ),
    "foundations": ("#e3f1e0", {"reporting", "settings", "runs", "files", "drake"}),
}


def main() -> None:
    """Writes weight.dot, weight.svg and house.svg."""
    save_diagram(TrialDiagram(DEFAULT_SETTINGS).diagram, HERE, "weight")
    (HERE / "house.svg").write_text(draw_house(), encoding="utf-8")


def draw_house() -> str:
    """Draws the layers of the library as SVG. A folder imports only from the rows below its own."""
    project = tomllib.loads((HERE.parent / "pyproject.toml").read_text(encoding="utf-8"))
    layers, extensions = (each["layers"] for each in project["tool"]["importlinter"]["contracts"][:2])
    rows = []
    for layer in layers:
        folders = layer.split(" | ")
        for colour, members in GROUPS.values():
            if members >= set(folders):
                rows.append((colour, " | ".join(extensions).split(" | ") if layer == "extensions" else folders))
    shapes = []
    for number, (colour, names) in enumerate(rows):
        width = WIDTH / len(names)
        for place, name in enumerate(names):
            x, y = place * width, number * HEIGHT
            shapes.append(
                f'<rect x="{x + 2:.0f}" y="{y + 2}" width="{width - 4:.0f}" height="{HEIGHT - 4}" fill="{colour}"/>'
            )
            shapes.append(f'<text x="{x + 0.5 * width:.0f}" y="{y + 19}">{name}</text>')
    below = len(rows) * HEIGHT + 20
    for place, (name, (colour, _)) in enumerate(GROUPS.items()):
        x = place * WIDTH / len(GROUPS)
        shapes.append(f'<rect x="{x + 2:.0f}" y="{below}" width="14" height="14" fill="{colour}" stroke="#999"/>')
        shapes.append(f'<text x="{x + 22:.0f}" y="{below + 12}" style="text-anchor: start">{name}</text>')
    style = "font: 13px sans-serif; text-anchor: middle"
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {below + 20}" style="{style}">'
    return "\n".join([head, *shapes, "</svg>"]) + "\n"


if __name__ == "__main__":
    main()
