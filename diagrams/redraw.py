"""Redraws the pictures in this folder from the Diagrams that are run: ``make diagrams``."""

from pathlib import Path

from affordance.experiments.protocol_runs import load_hold_experiment
from affordance.reporting.diagram_picture import save_diagram
from affordance.simulation.diagram import build_trial_diagram


def main() -> None:
    """Writes one .dot and one .svg file; all experiments run Diagrams wired like this, with other tools and tasks."""
    experiment = load_hold_experiment("weight")
    trial = build_trial_diagram(experiment.settings, experiment.duration)
    save_diagram(trial.diagram, Path(__file__).parent, experiment.name)


if __name__ == "__main__":
    main()
