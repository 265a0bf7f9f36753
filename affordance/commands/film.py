"""``affordance film``: writes a film of an experiment with one observer."""

import argparse
import tempfile
import warnings
from pathlib import Path

from affordance.arguments import check_number
from affordance.commands import options
from affordance.commands.catalogue import OF_THE_PAPER, find_experiment
from affordance.commands.setups import check_experiment, read_setup
from affordance.reporting.film import check_film, write_film
from affordance.reporting.replay import Replay


def run(arguments: argparse.Namespace) -> int:
    """Simulates one observer, writes the film, and returns the exit status."""
    options.check_bounds(arguments)
    check_experiment(arguments, OF_THE_PAPER)
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
    assert isinstance(results.replay, Replay)  # every experiment of the paper has one
    write_film(arguments.file, results.replay, seconds=arguments.seconds, slower=arguments.slower)
    print(f"{arguments.file}: {arguments.file.stat().st_size / 1000:.0f} kB")
    return 0
