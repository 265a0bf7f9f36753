"""Redraws the pictures in this folder from the Diagrams that are run: ``make diagrams``."""

from pathlib import Path

from affordance.experiments import weight
from affordance.reporting.diagram_picture import save_diagram
from affordance.simulation.diagram import build_trial_diagram


def main() -> None:
    """Writes one .dot and one .svg file; all experiments run Diagrams of this wiring, with other tools and tasks."""
    config = weight.load_config()
    trial = build_trial_diagram(config.tools[0], config.settings)
    save_diagram(trial.diagram, Path(__file__).parent, weight.NAME)


if __name__ == "__main__":
    main()
