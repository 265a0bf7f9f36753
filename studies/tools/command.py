"""``affordance study tools``: meshes, materials by part and predicted masses of real tools, and grips of a hammer."""

import argparse
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from affordance.commands.options import add_run_options
from studies.study import Findings, Study, Work, read_settings
from studies.tools import study
from studies.tools.data_set import Half
from studies.tools.drawings import save_figures
from studies.tools.numbers import list_details, list_metrics
from studies.tools.observer import ToolsConfig
from studies.tools.pictures import save_pictures
from studies.tools.report import describe
from studies.tools.study import ToolsResult


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument(
        "--data",
        type=Path,
        metavar="DIR",
        help="a clone of github.com/utiasSTARS/inertial-identification-with-part-segmentation; without it, only what "
        "needs no data is run: our own hammers, and figure 1",
    )
    add_run_options(parser, 10, "simulated observers that hold and predict", former=["--observers"], jobs=1)
    parser.add_argument(
        "--half",
        choices=("learning", "both"),
        default="both",
        help="half of the tools whose masses are predicted; choices were made on the learning half (default: both)",
    )


def plan(arguments: argparse.Namespace) -> Work:
    """Runs the study, which only reads files; the returned work writes the results."""
    config = ToolsConfig(
        data=arguments.data,
        models=arguments.models,
        seed=arguments.seed,
        observers=arguments.repeats,
        jobs=arguments.jobs,
        halves=(Half.LEARNING,) if arguments.half == "learning" else (Half.LEARNING, Half.TEST),
        settings=read_settings(arguments),
    )
    return partial(_work, study.run(config))


def _work(result: ToolsResult, folder: Path) -> Iterator[Findings]:
    draw = (partial(save_figures, result), partial(save_pictures, result))
    yield Findings(list_metrics(result), describe(result), details=list_details(result), writers=draw)


STUDY = Study(
    "meshes, materials by part, masses before first touch, and which end of a hammer to hold",
    add_arguments,
    plan,
    refused={("learner",): "observers learn one density for each colour"},
)
