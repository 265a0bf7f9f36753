"""``affordance next``: advises which object to hold next, and when to stop."""

import argparse

from affordance.arguments import check_number
from affordance.choice.listed_options import list_drawn_options
from affordance.choice.options import add_weighings
from affordance.choice.picking import MIN_FEASIBILITY, TIE
from affordance.choice.pricing import GripBounds, plan_options
from affordance.commands.advice.workbench import (
    Bench,
    break_lines,
    check_choice,
    choose_strikers,
    open_bench,
    rank_tools,
    see_tools,
    tell_sources,
)
from affordance.commands.answers import give_answer
from affordance.commands.options import open_robot
from affordance.commands.terminal import find_width
from affordance.exceptions import AffordanceError, name_object
from affordance.extensions.advice.advice_figure import draw_holds
from affordance.extensions.advice.advice_text import describe_knowledge, name_option
from affordance.extensions.advice.expected_inertia import build_expectations, describe_expectations, expect
from affordance.extensions.advice.known_materials import learn_weighings
from affordance.extensions.advice.next_hold import SETTLED, HoldAdvice, OpenDecision, Question, advise_hold
from affordance.extensions.memory.ledger import describe_past_arms, open_memory
from affordance.extensions.memory.summary import name_things
from affordance.files.atomic import to_plain
from affordance.objects.appearance import Appearance
from affordance.objects.tool import Tool
from affordance.reporting.formatting import tabulate_within
from affordance.settings import Settings

_PRICE_MAX = 1e9
_NAME = "next"
# Columns that are dropped first if the table is too wide.
_INFORMATION, _THEN = 2, 3
# A choice is a tie if its expected loss is at most this fraction of the cost.
_TIE = 1e-3
# The text mentions heavy objects: those that the arm can hold with a probability below this.
_SURELY = 0.995


def run(arguments: argparse.Namespace) -> int:
    """Prints which object to hold next, and writes the answer and a figure to the folder of ``--out``."""
    check_number("--price", arguments.price, 0.0, _PRICE_MAX)
    bounds = check_choice(arguments, 100)
    robot = open_robot(arguments)
    bench = open_bench(arguments, robot, arguments.tasks, arguments.may_hold)
    settings, tasks, memory = bench.settings, bench.tasks, bench.named.memory
    candidates = _list_candidates(bench, arguments)
    options = see_tools(arguments, bench)
    if memory.learner.is_exact:
        drawn = add_weighings(list_drawn_options(candidates), candidates)
        objects = {option.object_name: option for option in [*drawn, *options]}
        memory = learn_weighings(memory, objects, settings.prior)
    questions, remarks = list[Question](), list(bench.remarks)
    for name, task in tasks.items():
        usable, said = choose_strikers(options, task, bench.tools, arguments.tools)
        questions.append(Question(name, plan_options(usable, task, settings)))
        remarks += said
    advice = advise_hold(
        candidates,
        questions,
        memory,
        settings,
        criterion=bench.criterion,
        bounds=None if bounds == GripBounds() else bounds,
        price=arguments.price,
        looks=_recall_looks(arguments.memory, settings),
        looks_ahead=True,
        num_samples=arguments.samples,
        seed=arguments.seed,
    )
    if advice.stop and not any(each.is_usable for each in advice.decisions):
        # This raises an error that explains why no option is usable.
        rank_tools(arguments, bench, questions[0].choice, tasks[questions[0].name], bounds)
    expected = [expect(tool, memory, settings) for tool in candidates]
    content = {
        **to_plain(advice),
        **tell_sources(arguments, robot, bench.named),
        "rests_on": list(advice.rests_on),
        "sentence": describe_stop(advice),
        "expected": build_expectations(expected),
    }
    width = find_width()
    lines = [content["sentence"], describe_past_arms(robot.name, content["trials_of_other_arms"])]
    lines += [*(f"warning: {each}" for each in remarks), *describe_holds(advice, width)]
    lines += describe_expectations(content["expected"], width)
    lines.append(f"materials: {describe_knowledge(content)}")
    give_answer(arguments, _NAME, break_lines(lines, width), content, lambda: draw_holds(content))
    return 0


def describe_holds(advice: HoldAdvice, width: int = 0) -> list[str]:
    """Formats the current choices, and the worth of holding each object."""
    lines = [f"{each.name}: {_describe_decision(each, advice.unit)}" for each in advice.decisions]
    rows = [["", f"worth ({advice.unit})", "information (nat)", "P(best) after"]]
    for each in advice.ranked:
        then = ", ".join(f"{p:.2f}" for p in each.p_best_after)
        worth = f"{each.worth:9.3g} ± {each.worth_se:<8.2g}"
        rows.append([each.name, worth, f"{each.information:.2f}", then])
    lines += tabulate_within(rows, width, (_INFORMATION, _THEN))
    for each in advice.ranked:
        if each.p_held < _SURELY:
            lines.append(f"The arm can hold {name_object(each.name)} with probability {each.p_held:.2f}.")
    return lines


def _describe_decision(decision: OpenDecision, unit: str) -> str:
    """Describes which option to take now, or why no option is possible, in the same words as ``rank``."""
    tool, _, grip = decision.best.rpartition(" by ")
    name = name_option(tool or grip, grip if tool else "", decision.alike)
    if not decision.is_possible:
        p = 1.0 - decision.p_possible
        return f"no option can do it (P = {p:.3f}); nearest is {name}: {decision.infeasible_reason}"
    if not decision.is_usable:
        return (
            f"no option is usable yet: {name} comes nearest, feasible with probability {decision.p_feasible:.2f}, "
            f"which must be at least {MIN_FEASIBILITY:g}: {decision.infeasible_reason}"
        )
    return f"take {name}, best with probability {decision.p_best:.2f}; expected loss {decision.regret:.3g} {unit}"


def describe_stop(advice: HoldAdvice) -> str:
    """Describes which object to hold next, or why no further object needs to be held."""
    first, unit = advice.ranked[0], advice.unit
    rests = ", and ".join(_describe_support(each) for each in advice.decisions if each.rests_on)
    if advice.check:
        return f"Hold {name_object(advice.check)} to check: {rests}."
    found = f" But {rests}: holding another object of the same material would check it." if rests else ""
    if advice.stop == "impossible":
        return "Nothing here is worth holding: no option can do these tasks."
    if advice.stop == "settled":
        now = ", ".join(f"{each.name} {_describe_settled(each)}" for each in advice.decisions)
        return f"Nothing more needs to be held: {now}.{found}"
    if advice.stop:
        left = "; ".join(_describe_open(each, unit) for each in advice.decisions if not each.is_settled)
        if advice.price and first.worth:
            saved = f"{name_object(first.name)} would save {first.worth:.2g} {unit}"
            return f"Nothing here is worth its price of {advice.price:g} {unit}: {saved}; {left}.{found}"
        return f"Nothing here is worth holding: {left}.{found}"
    if advice.pair is not None:
        one, other = (name_object(each) for each in advice.pair)
        head = f"Hold {one} and then {other}: worth {advice.pair_worth:.3g} {unit} together, little alone"
        later = advice.plan[2:]
    else:
        worth = f"worth {first.worth:.3g} ± {first.worth_se:.1g} {unit}"
        head, later = f"Hold {name_object(first.name)}: {worth}", advice.plan[1:]
    if later:
        head += f"; then {name_object(later[0])}"
    then = ", ".join(
        f"{p:.2f} for {each.name}" for p, each in zip(advice.p_best_planned, advice.decisions, strict=True)
    )
    holds = "hold" if len(advice.plan) == 1 else "holds"
    gain = "" if min(advice.p_best_planned) >= SETTLED else "further holds gain nothing; "
    return f"{head}. After about {len(advice.plan)} {holds}, {gain}P(best) is then {then}."


def _describe_settled(decision: OpenDecision) -> str:
    """Describes the probability that a settled choice is right."""
    if decision.is_possible:
        return f"is decided (P = {decision.p_best:.2f})"
    return f"cannot be done (P = {1.0 - decision.p_possible:.2f})"


def _describe_support(decision: OpenDecision) -> str:
    """Names the objects that support a settled choice: without their evidence it would not be settled."""
    names = [name_object(name) for name in decision.rests_on]
    if len(names) == 1:
        return f"the choice for {decision.name} rests on {names[0]} alone"
    return f"the choice for {decision.name} depends on each of {', '.join(names)}"


def _describe_open(decision: OpenDecision, unit: str) -> str:
    """Describes an open choice that no hold can settle: a tie, or an expected loss."""
    margin = decision.margin
    if margin is not None and max(margin, decision.regret) <= _TIE * decision.cost:
        gap = 0.0 if abs(margin) <= TIE * decision.cost else margin
        return f"{decision.name} is a tie (P = {decision.p_best:.2f}): the best two differ by {gap:.2g} {unit}"
    return f"{decision.name} stays open (P = {decision.p_best:.2f}, expected loss {decision.regret:.2g} {unit})"


def _list_candidates(bench: Bench, arguments: argparse.Namespace) -> list[Tool]:
    """Lists the objects that may be held.

    Raises:
        AffordanceError: The files of objects and tools use the same name.
    """
    if arguments.may_hold.resolve() == arguments.tools.resolve():
        return bench.stock
    names = {tool.name for tool in bench.tools}
    for each in bench.stock:
        if each.name in names:
            raise AffordanceError(
                f"{arguments.may_hold}: {each.name!r} is also a tool of {arguments.tools}, must have another name; "
                "--include-tools allows holding the tools themselves"
            )
    return [*bench.stock, *(bench.tools if arguments.include_tools else [])]


def _recall_looks(place: str | None, settings: Settings) -> dict[str, Appearance]:
    """Reads the appearance of each object in a memory, by the object's name; empty without a memory."""
    if place is None:
        return {}
    with open_memory(place, create=False) as ledger:
        memory, found = ledger.review(settings.prior)
    return {name: thing.appearance for name, thing in zip(name_things(found), memory.things, strict=True)}
