"""Report of the study of active choice: what to hold next, and how to move while weighing."""

from collections.abc import Mapping
from typing import Any

from affordance.reporting.claims import ClaimResult, Unit, check, claim
from affordance.reporting.formatting import count_observers
from affordance.reporting.section import ReportFigure, Section, Table

J, COUNT, SHARE = Unit("J"), Unit(digits=0), Unit(digits=3)


def describe(numbers: Mapping[str, Any]) -> Section:
    """Describes the results; those about motions only if recordings were given."""
    return Section(
        order=35,
        title="What to hold next, and how to move",
        summary=(
            f"{count_observers(numbers['repeats'])} of each rule on the paper's arm may hold nine pieces of stock"
            " before they choose among our hammers for driving a nail and for reaching, and among two kitchen"
            " tools for mashing. Four of the nine are made of materials that are in no tool. Each object is held"
            " at most once, for one second of simulation. All objects deviate from their materials, and the learner"
            f" is the paper's. In the paper's world {numbers['paper_repeats']} observers of each rule choose the"
            " grips of five new tools for reaching and hammering, after up to eight objects were held at rest. All"
            " rules see the same worlds and errors."
        ),
        figures=_list_figures(has_motions=numbers["has_motions"]),
        claims=judge(numbers),
        tables=[*_list_tables(numbers), *([_tabulate_motions(numbers["excite"])] if numbers["has_motions"] else [])],
        remarks=_list_remarks(numbers),
    )


def judge(n: Mapping[str, Any]) -> list[ClaimResult]:
    """Judges the claims; those about motions only if recordings were given."""
    claims = [
        claim("few_holds", "ours",
              "The object that is worth most is held first, so that choices become right after few holds.",
              check("holds until .95 of the choices are right", n["value_holds"], COUNT, at_most=4),
              check("holds divided by those in random order", n["value_over_random"], at_most=0.5),
              check("holds divided by those by information", n["value_over_information"], at_most=0.5),
              check("holds minus those of the best other rule", n["value_less_best_other"], COUNT, below=0),
              check("regret after three holds", n["regret_after_3"], J, at_most=0.1)),
        claim("paper_world", "ours", "In the paper's world two holds are enough to make each of ten choices right.",
              check("holds until .95 of all choices are right", n["paper_holds"], COUNT, at_most=2),
              check("most holds needed for any choice", n["paper_holds_most"], COUNT, at_most=2)),
        claim("worth", "ours",
              "Worth by regression agrees with nested brute force, and objects that tell nothing are worth nothing.",
              check("share within 15 % or two standard errors", n["worths_within"], at_least=1),
              check("cases", n["worth_cases"], COUNT, at_least=20),
              check("largest worth of these objects", n["irrelevant_J"], Unit("J", digits=3), at_most=0.01)),
        claim("stopping", "ours",
              "In worlds drawn from the prior, choices called certain are right, and nearly all observers stop by"
              " themselves"
              " within seven holds.",
              check("share of right ones among choices called certain", n["drawn_right"], SHARE, at_least=0.96),
              check("share of observers that stop by themselves", n["drawn_stopped"], at_least=0.8)),
        claim("odd_object", "ours", "Choices called certain are right even if one object is not what it looks like.",
              check("share of right ones among choices called certain", n["decoy_right"], SHARE, at_least=0.95)),
        claim("repeats", "ours", "However often one object is held, its deviation from its material counts once.",
              check("least root mean square of errors divided by their standard deviations",
                    n["repeat_z_least"], at_least=0.9),
              check("largest", n["repeat_z_largest"], at_most=1.1)),
        claim("kinds", "ours",
              "A learner with kinds gains the information that was predicted, even from an odd object.",
              check("largest difference", n["kinds_worst"], Unit("nat", digits=3), at_most=0.05)),
        claim("fast", "ours", "Advice takes little time.",
              check("time for each candidate at 4000 samples", n["ms_per_candidate"], Unit("ms"), at_most=10)),
    ]  # fmt: skip
    return [*claims, *(_judge_motions(n) if n["has_motions"] else [])]


def _judge_motions(n: Mapping[str, Any]) -> list[ClaimResult]:
    return [
        claim("few_postures", "ours",
              "A few well-chosen postures are as good as eight random ones, and more postures do no harm.",
              check("number of postures as good as eight random ones", n["poses_as_8_random"], COUNT, at_most=5),
              check("increase of the error with more postures", n["worse_with_more"], at_most=0.2)),
        claim("honest", "ours", "Intervals of masses have the stated coverage with chosen postures.",
              check("masses inside 90 % intervals", n["inside_90"], at_least=0.8, at_most=0.98)),
        claim("fast_to_the_floor", "ours",
              "A designed motion reaches the least possible error in half of the time that random motions take.",
              check("time to 1.2 times the floor, divided by theirs", n["seconds_over_random"], at_most=0.5)),
        claim("within_limits", "ours", "No limit of angle, velocity, acceleration, torque or tip is exceeded.",
              check("largest fraction of a limit", n["largest_share_of_a_limit"], at_most=1)),
    ]  # fmt: skip


def _list_figures(*, has_motions: bool) -> list[ReportFigure]:
    rules = ReportFigure(
        file="active.png",
        caption=(
            "Right choices with 95 % intervals, and the remaining regret, against the number of objects held:"
            ' by worth ("value"), by worth if costs were linear and beliefs normal, by information about'
            " materials, largest first, and at random."
        ),
    )
    poses = ReportFigure(
        file="poses.png",
        caption=(
            "Error of the mass against the number of postures, mean over three weighed objects: true error, and"
            " stated error (thin). Postures are chosen from pools of 150 recorded ones: to minimise the standard"
            ' deviation that identification would state ("stated"), at random, by condition number and least singular'
            " value, and by determinant with prior information; the latter two assume white noise. Everything else is"
            " known from the other two objects."
        ),
    )
    motions = ReportFigure(
        file="motions.png",
        caption=(
            "Error of the mass against the length of a motion: true error, and stated error (thin), for simulated"
            " payloads with errors and limits of a Panda and of a UR10e as recorded."
        ),
    )
    return [rules, poses, motions] if has_motions else [rules]


def _list_tables(n: Mapping[str, Any]) -> list[Table]:
    workshop, paper = (n[world]["holds_to_95"] for world in ("workshop", "paper_world"))
    stops = {
        "drawn from the prior": n["drawn"],
        "drawn from the prior, no doubts": n["drawn_undoubted"],
        "one odd object, no doubts": n["decoy_stops"]["before"],
        "one odd object, with doubts": n["decoy_stops"]["after"],
    }
    by_learner = (n["repeat_z"], *(n["repeat_z_observers"][each] for each in ("density", "kinds_map", "kinds_drawn")))
    z = (*by_learner, n["repeat_z_anew"])
    return [
        Table(
            "Number of holds after which .95 of the choices stay right (if never, one more than were tried).",
            ["rule", "workshop", "the paper's world"],
            [[_name(rule), str(count), str(paper[rule])] for rule, count in workshop.items()],
        ),
        Table(
            (
                "Observers that hold what is advised until the advice is to stop; choices called certain, and the"
                " share of right ones among these."
            ),
            ["world", "holds", "stopped", "as certain", "choices called certain", "right"],
            [
                [
                    world,
                    f"{each['holds']:.1f}",
                    *(f"{each[key]:.2f}" for key in ("stopped", "stopped_as_certain", "certain")),
                    f"{each['right']:.3f}",
                ]
                for world, each in stops.items()
            ],
        ),
        Table(
            (
                "Error of the mean density divided by its standard deviation, root mean square after ten holds of one"
                " object: with a lasting memory, for observers by their learner, and if the object's deviation is"
                " counted again in each hold."
            ),
            ["material", "memory", "one density", "kinds", "kinds drawn", "anew"],
            [[_name(material), *(f"{each[material]:.2f}" for each in z)] for material in n["repeat_z"]],
        ),
    ]


def _tabulate_motions(excite: Mapping[str, Any]) -> Table:
    arms = (excite["panda"], excite["ur10e"])
    rows = [[_name(rule), *(f"{arm['seconds_to_floor'][rule]:.1f}" for arm in arms)] for rule in arms[0]["rules"]]
    return Table(
        (
            "Seconds until the stated error stays within 1.2 times the floor (17 if never within 16 s; for random"
            " motions 33 if never within 32 s), and the floor."
        ),
        ["rule", "Panda", "UR10e"],
        [*rows, ["floor (g)", *(f"{arm['floor_g']:.1f}" for arm in arms)]],
    )


def _list_remarks(n: Mapping[str, Any]) -> list[str]:
    remarks = [
        "The polynomial's degree, twelve in one variable, was chosen after these comparisons with brute force had"
        " been seen with degree six. Samples are spread evenly because two of 22 cases had been wrong by chance."
        f" Drawn worlds are without hammering; {n['drawn']['certain']:.2f} of the choices are ever certain, the"
        " others are near ties. At first these worlds were run without doubts about odd objects; they are run with"
        " doubts since the command has them by default."
    ]
    if n["has_motions"]:
        remarks.append(
            "Postures are chosen with the body identified from earlier postures, because with the body expected"
            ' beforehand six are needed. "Stated" motions are Fourier series; visits to postures are reported'
            " separately."
        )
    return remarks


def _name(name: str) -> str:
    return name.replace("_", " ")
