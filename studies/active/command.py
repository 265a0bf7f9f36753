"""``affordance study active``: how many holds it takes until tools are chosen rightly, by what picks them."""

import argparse
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from affordance.arrays import Arrays
from affordance.commands.options import add_jobs, add_out, add_repeats, add_seed
from affordance.files.model_folder import MODELS
from studies.active import stopping
from studies.active.brute_force import compare_worths, summarise_errors
from studies.active.figure import draw_rules
from studies.active.kinds import compare_information
from studies.active.rules import RULES
from studies.active.study import ActiveConfig, describe_rules, run_observer, time_advice
from studies.study import Findings, Study, Work, run_kept


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_repeats(parser, 200, "simulated observers of each rule")
    for add in (add_seed, add_jobs, add_out):
        add(parser)


def plan(arguments: argparse.Namespace) -> Work:
    """Returns what is to be run."""
    return partial(_work, arguments)


def _work(arguments: argparse.Namespace, folder: Path) -> Iterator[Findings]:
    def run[C](config: C, observe: Callable[[C, int], Arrays], repeats: int, name: str) -> Arrays:
        return run_kept(
            config, observe, folder, MODELS, repeats=repeats, jobs=arguments.jobs, description=f"active: {name}"
        )

    seed, repeats = arguments.seed, arguments.repeats
    found = {rule: run(ActiveConfig(rule, seed), run_observer, repeats, rule) for rule in RULES}
    stops = {
        name: stopping.describe_stops(run(config, stopping.run_observer, number, name))
        for name, (config, number) in stopping.list_configs(seed, repeats).items()
    }
    described = describe_rules(found)
    numbers = {
        "repeats": repeats,
        "seed": seed,
        **described,
        **summarise_errors(compare_worths()),
        **stopping.summarise(stops),
        **compare_information(),
        "ms_per_candidate": time_advice(),
    }
    rules = described["workshop"]["rules"]
    yield Findings(numbers=numbers, figures={"active": partial(draw_rules, rules)})


STUDY = Study(
    HELP="holds that it takes until tools are chosen rightly, by the rule that picks what is held",
    add_arguments=add_arguments,
    plan=plan,
    folder="active",
    section=Path(__file__).with_name("section.yaml"),
)
