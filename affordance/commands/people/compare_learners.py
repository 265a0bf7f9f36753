"""``affordance compare-learners``: compares how well learners predict each participant's lifts."""

import argparse
import json

from affordance.belief.learners import KINDS_DRAWN, LEARNERS
from affordance.commands.options import read_learner
from affordance.commands.people.people_options import KEPT, ask, prepare_new_folder, read_setting
from affordance.extensions.people.comparison_figures import draw_pushes, draw_scores
from affordance.extensions.people.fit import compare, warn_of_noise
from affordance.extensions.people.predictive_check import check_person
from affordance.extensions.people.rivals import RIVALS
from affordance.files.atomic import write_json, write_text
from affordance.reporting.figures import save_figure


def run(arguments: argparse.Namespace) -> int:
    """Prints log scores and BIC of each learner by participant, and the expected frequency of each learner."""
    settings, lifts = read_setting(arguments)
    learners = tuple(dict.fromkeys(map(read_learner, arguments.learner)))
    learners = learners or (LEARNERS["density"], KINDS_DRAWN, *RIVALS.values())
    questions = {learner.name: ask(arguments, settings, lifts, learner, None) for learner in learners}
    found = compare([*questions.values()], arguments.out / KEPT)
    best, chosen = found.find_best(), found.selection
    frequencies = {
        name: {"best_for": best.count(name), "log_score": float(found.scores[name].sum())}
        | {"frequency": float(chosen.frequencies[i]), "exceedance": float(chosen.protected[i])}
        for i, name in enumerate(found.scores)
    }
    lines = [found.tabulate().to_string(index=False, float_format="{:.2f}".format)]
    for name, of in frequencies.items():
        lines.append(
            f"{name}: best for {of['best_for']} of {len(best)}, log score {of['log_score']:.1f} in all, "
            f"expected frequency {of['frequency']:.2f}, protected exceedance probability {of['exceedance']:.2f}"
        )
        noise = [each.noise for each in found.fits[name]]
        lines += warn_of_noise([f"{each}, {name}" for each in found.participants], noise)
    content = {
        "participants": found.participants,
        "log_score": {name: values.tolist() for name, values in found.scores.items()},
        "bic": {name: values.tolist() for name, values in found.bic.items()},
        "particle_noise": {name: [each.noise for each in fits] for name, fits in found.fits.items()},
        "probability": dict(zip(found.scores, chosen.people.T.tolist(), strict=True)),
        "best_by_score": best,
        "best_by_bic": found.find_best("bic"),
        "learners": frequencies,
        "all_equally_frequent": chosen.equal,
    }
    folder = prepare_new_folder(arguments.out / f"compare_{arguments.lifts.stem}")
    if arguments.check:
        failed: dict[str, list[str]] = {}
        for place, (participant, name) in enumerate(zip(found.participants, best, strict=True)):
            check = check_person(questions[name], place, found.fits[name][place].draws.normal)
            failed[participant] = [each.name for each in check if each.fails]
            if failed[participant]:
                said = f"none of these learners, {name} least badly: {', '.join(failed[participant])}"
                lines.append(f"check, {participant}: {said}")
        lines.append(f"None of these learners for {sum(map(bool, failed.values()))} of {len(best)} people.")
        content["not_described"] = failed
    write_text(folder / "comparison.csv", found.tabulate().to_csv(index=False, float_format="%.7g"))
    write_json(folder / "comparison.json", content)
    save_figure(draw_scores(found), folder, "comparison")
    save_figure(draw_pushes(found, lifts), folder, "pushes")
    print(
        json.dumps(content, indent=2)
        if arguments.json
        else "\n".join([*lines, f"The table: {folder / 'comparison.csv'}"])
    )
    return 0
