"""Redraws the pictures in this folder from the Diagrams that are run: ``make diagrams``."""

from pathlib import Path

from affordance.reporting.diagram_picture import save_diagram
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.diagram import TrialDiagram


def main() -> None:
    """Writes one .dot and one .svg file; all experiments run Diagrams wired like this, with other tools and tasks."""
    trial = TrialDiagram(DEFAULT_SETTINGS)
    save_diagram(trial.diagram, Path(__file__).parent, "weight")


if __name__ == "__main__":
    main()
