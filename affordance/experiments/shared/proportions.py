"""Proportions of correct choices, as numbers and as figures 8 and 10."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from affordance.experiments.definition import Arrays
from affordance.experiments.shared.choice_task import ChoicePlan
from affordance.experiments.shared.correct_grip import Simulated, find_cheaper_grip
from affordance.experiments.shared.decisions import choose_before_experience, estimate_correct
from affordance.experiments.shared.experience import ExperienceConfig
from affordance.objects.symmetry import is_symmetric
from affordance.objects.tool import Tool
from affordance.reporting import figures
from affordance.reporting.formatting import count_observers
from affordance.reporting.statistics import Estimate


def compute_proportions(
    novel: Sequence[Tool], plan: ChoicePlan, arrays: Arrays, experience: ExperienceConfig
) -> dict[str, Any]:
    """Computes the proportions of correct choices.

    Args:
        novel: Novel tools; the first is the paper's.
        plan: Plan that all observers share.
        arrays: Choices of all observers; see ``let_observer_choose``.
        experience: Configuration of the experience.
    """
    choices, simulated = plan.choices, plan.simulated
    correct = {name: find_cheaper_grip(done) for name, done in simulated.items()}
    tools = {}
    estimates: dict[str, Estimate] = {}
    for index, (name, choice) in enumerate(choices.items()):
        grips = [option.grip for option in choice.options]
        before = choose_before_experience(choice, experience.colours, experience.seed)
        estimates[name] = estimate_correct(arrays["paper"][:, index], before, grips.index(correct[name]))
        tools[name] = {
            "p_correct": estimates[name].mean,
            "p_correct_ci95": estimates[name].ci95,
            "correct_grip": correct[name],
            "energy_true": {grip: done.work for grip, done in simulated[name].items()},
            "chance": estimates[name].mean[0],
            "chance_by_symmetry": is_symmetric(novel[index]),
            "energy_ratio_true": compute_energy_ratio(simulated[name]),
            "off_axis_2mm_change": plan.off_axis[name],
        }
    first, *others = choices
    grips = [option.grip for option in choices[first].options]
    bayes = estimate_correct(arrays["bayes"], None, grips.index(correct[first]))
    numbers = {
        "p_correct": estimates[first].mean,
        "p_correct_ci95": estimates[first].ci95,
        "p_correct_bayes": bayes.mean,
        "p_correct_bayes_ci95": bayes.ci95,
        "effort_flips": arrays["flips"].mean(axis=0),
        "correct_grip": correct[first],
        "energy_ratio_true": tools[first]["energy_ratio_true"],
        "tools": tools,
        "off_axis_2mm_change": max(plan.off_axis.values()),
    }
    if others:
        numbers["p_correct_headed_tool"] = estimates[others[0]].mean
        numbers["p_correct_headed_tool_ci95"] = estimates[others[0]].ci95
        numbers["correct_grip_headed_tool"] = correct[others[0]]
        numbers["energy_true_headed_tool"] = tools[others[0]]["energy_true"]
    return numbers


def compute_energy_ratio(simulated: Mapping[str, Simulated]) -> float:
    """Computes the ratio of the work with the costliest grip to that with the cheapest."""
    works = [done.work for done in simulated.values()]
    return max(works) / min(works)


def describe_tools(tools: Sequence[Tool], numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the facts about the tools that section files name."""
    effort = numbers["effort_true"]
    return {
        "first": tools[0].name,
        "others": [tool.name for tool in tools[1:]],
        "materials": {
            tool.name: list(dict.fromkeys(part.material.name for part in tool.components)) for tool in tools
        },
        "num_trials": len(numbers["p_correct"]) - 1,
        "least_effort_grip": min(effort, key=effort.__getitem__),
    }


def draw_proportions(tools: Sequence[Tool], numbers: Mapping[str, Any], title: str, num_observers: int) -> Figure:
    """Draws the proportions of correct choices, figures 8 and 10."""
    estimates = {
        f"{name} (chance by symmetry)" if each["chance_by_symmetry"] else name: Estimate(
            each["p_correct"], *np.moveaxis(each["p_correct_ci95"], -1, 0)
        )
        for name, each in numbers["tools"].items()
    }
    first = tools[0].name
    estimates[f"{first}, least expected absolute work"] = Estimate(
        numbers["p_correct_bayes"], *np.moveaxis(numbers["p_correct_bayes_ci95"], -1, 0)
    )
    return figures.draw_choices(estimates, title=f"{title}, {count_observers(num_observers)}, 95 % intervals")
