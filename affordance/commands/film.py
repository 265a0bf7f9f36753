"""``affordance film``: writes a film of one observer in an experiment."""

import argparse
import tempfile
import warnings
from pathlib import Path

from affordance.arguments import check_number
from affordance.commands import options
from affordance.commands.catalogue import find_experiment
from affordance.commands.setups import check_experiment, read_setup
from affordance.reporting.film import check_film, write_film
from affordance.reporting.replay import Replay

_FILMED = ("weight", "com", "reach", "hammer")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument("experiment", help=f"one of {', '.join(_FILMED)}")
    parser.add_argument("file", type=Path, help="film to write: .gif, or .webm or .mp4 (these need imageio-ffmpeg)")
    parser.add_argument(
        "--seconds",
        type=float,
        default=60.0,
        metavar="S",
        help="length of the experiment that is shown, s (default: all)",
    )
    parser.add_argument(
        "--slower", type=float, default=1.0, metavar="TIMES", help="factor by which it is slowed down (default 1)"
    )
    options.add_robot(parser)
    options.add_seed(parser)
    options.add_set(parser)
    options.add_learner(parser)


def run(arguments: argparse.Namespace) -> int:
    """Runs one observer and writes the film; returns the exit status."""
    options.check_bounds(arguments)
    check_experiment(arguments, _FILMED)
    check_number("--seconds", arguments.seconds, 0.1, 60.0, "s")
    check_number("--slower", arguments.slower, 0.1, 100.0)
    check_film(arguments.file)
    robot = options.open_robot(arguments)
    print("One observer is simulated and each picture rendered, which takes about a minute.", flush=True)
    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder:
        warnings.simplefilter("ignore")  # statistics of a single observer
        arguments.repeats, arguments.jobs, arguments.out = 1, 1, Path(folder)
        results = find_experiment(arguments.experiment).run(
            read_setup(arguments, robot, options.read_changes(arguments))
        )
    assert isinstance(results.replay, Replay)  # every experiment in _FILMED has one
    write_film(arguments.file, results.replay, seconds=arguments.seconds, slower=arguments.slower)
    print(f"{arguments.file}: {arguments.file.stat().st_size / 1000:.0f} kB")
    return 0
