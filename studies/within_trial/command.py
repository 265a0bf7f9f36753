"""``affordance study within_trial``: follows the belief and the arm within the first trial of Simulation I."""

import argparse
from pathlib import Path

from affordance.commands.options import add_models, add_out, add_seed, add_set, change_by_name, check_bounds
from affordance.experiments.protocol_runs import load_hold_experiment
from affordance.plant.arm import ARM
from affordance.runs.repeats import prepare_folder
from affordance.settings import Settings
from studies.study import Findings, write_findings
from studies.within_trial.study import WHITE, WithinTrialStudy

HELP = "the belief as it narrows within a trial, and an arm that already uses it"
NAME = "within_trial"
SECTION = Path(__file__).with_name("section.yaml")
# Index of the observer.
_OBSERVER = 0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_seed(parser)
    add_out(parser)
    add_models(parser)
    add_set(parser)


def run(arguments: argparse.Namespace) -> int:
    """Runs the study.

    Raises:
        AffordanceError: An argument or a file is invalid.
    """
    check_bounds(arguments)
    settings = change_by_name(arguments, Settings(arm=arguments.models / ARM.name))
    weight = load_hold_experiment("weight", arguments.models, arguments.seed, settings)
    tool = weight.tools[0]
    study = WithinTrialStudy(settings, tool, duration=weight.duration, seed=(weight.seed, _OBSERVER, 0))
    facts = {"name": tool.name, "white_sd": WHITE.sd, "run_shown": _OBSERVER}
    figures = {"posterior": study.draw_growth, "sinking": study.draw_sinking}
    findings = Findings({**study.summarise(), "seed": weight.seed}, facts, figures)
    print(f"The report: {write_findings(findings, prepare_folder(arguments.out) / NAME, SECTION)}")
    return 0
