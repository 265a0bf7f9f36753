"""``affordance compare-learners``: which learner predicts the lifts of each person best."""

import argparse
import json

from affordance.belief.learners import KINDS_DRAWN, LEARNERS
from affordance.commands.options import read_learner
from affordance.commands.people.people_options import (
    ask,
    prepare_new_folder,
    read_setting,
)
from affordance.extensions.people.fit import compare, warn_of_noise
from affordance.extensions.people.rivals import RIVALS
from affordance.files.atomic import write_json, write_text


def run(arguments: argparse.Namespace) -> int:
    """Prints log scores one step ahead and BIC of each learner, by participant."""
    settings, lifts = read_setting(arguments)
    learners = tuple(dict.fromkeys(map(read_learner, arguments.learner)))
    learners = learners or (LEARNERS["density"], KINDS_DRAWN, *RIVALS.values())
    found = compare([ask(arguments, settings, lifts, learner, None) for learner in learners])
    table = found.tabulate()
    folder = prepare_new_folder(arguments.out / f"compare_{arguments.lifts.stem}")
    write_text(folder / "comparison.csv", table.to_csv(index=False, float_format="%.7g"))
    content = {
        "participants": found.participants,
        "log_score": {name: values.tolist() for name, values in found.scores.items()},
        "bic": {name: values.tolist() for name, values in found.bic.items()},
        "particle_noise": {name: values.tolist() for name, values in found.noise.items()},
        "best_by_score": found.find_best(),
        "best_by_bic": found.find_best("bic"),
    }
    write_json(folder / "comparison.json", content)
    if arguments.json:
        print(json.dumps(content, indent=2))
        return 0
    print(table.to_string(index=False, float_format="{:.1f}".format))
    for name in found.scores:
        count = found.find_best().count(name)
        print(
            f"{name}: best for {count} of {len(found.participants)}, log score {found.scores[name].sum():.1f} in all"
        )
        for line in warn_of_noise([f"{each}, {name}" for each in found.participants], found.noise[name]):
            print(line)
    print(f"The table: {folder / 'comparison.csv'}")
    return 0
