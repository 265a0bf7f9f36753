"""``affordance study tools``: meshes, materials by part and predicted masses of real tools, and grips of a hammer."""

import argparse
import logging
from functools import partial
from pathlib import Path

from affordance.commands.options import add_run_options, change_by_name, check_bounds, refuse_changes
from affordance.plant.arm import ARM
from affordance.settings import Settings
from studies.study import Findings, write_findings
from studies.tools import study
from studies.tools.data_set import Half
from studies.tools.drawings import save_figures
from studies.tools.numbers import list_details, list_metrics
from studies.tools.pictures import save_pictures
from studies.tools.section import describe
from studies.tools.study import ToolsConfig, ToolsResult

HELP = "meshes, materials by part, masses before first touch, and which end of a hammer to hold"
NAME = "tools"

_LOG = logging.getLogger(__name__)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument(
        "--data",
        type=Path,
        metavar="DIR",
        help="a clone of github.com/utiasSTARS/inertial-identification-with-part-segmentation; without it, only what "
        "needs no data is run: our own hammers, and figure 1",
    )
    add_run_options(parser, 10, "simulated observers, who hold and predict", former=["--observers"], jobs=1)
    parser.add_argument(
        "--half",
        choices=("learning", "both"),
        default="both",
        help="of which tools masses are predicted; everything was chosen on the learning half (default: both)",
    )


def run_study(config: ToolsConfig, folder: Path) -> int:
    """Runs the study, and writes numbers, figures and a report section into a folder.

    Returns: Number of claims that are not met.
    """
    return write_study(study.run(config), folder)


def write_study(result: ToolsResult, folder: Path) -> int:
    """Writes the results into a folder, and prints them; returns the number of claims that are not met."""
    section = describe(result)
    draw = (partial(save_figures, result), partial(save_pictures, result))
    write_findings(Findings(list_metrics(result), details=list_details(result), writers=draw), folder, section)
    missed = 0
    for claim in section.claims:
        missed += not claim.met
        found = "; ".join(f"{each.name} {each.value}, {each.bound}" for each in claim.criteria)
        print(f"{'met    ' if claim.met else 'not met'} {claim.text} {found}")
    for paragraph in (section.summary, *section.remarks):
        print(paragraph)
    return missed


def run(arguments: argparse.Namespace) -> int:
    """Runs the command; unmet claims are reported, and do not affect the exit status.

    Raises:
        AffordanceError: An argument or a file is invalid.
    """
    check_bounds(arguments)
    refuse_changes(arguments, ["learner"], "tools are learned about with one density for each colour")
    halves = (Half.LEARNING,) if arguments.half == "learning" else (Half.LEARNING, Half.TEST)
    config = ToolsConfig(
        data=arguments.data,
        models=arguments.models,
        seed=arguments.seed,
        observers=arguments.repeats,
        jobs=arguments.jobs,
        halves=halves,
        settings=change_by_name(arguments, Settings(arm=arguments.models / ARM.name)),
    )
    missed = run_study(config, arguments.out / NAME)
    _LOG.info("%d claims are not met", missed)
    return 0
