"""Small runs of the simulations, each made once; a module says by a fixture ``name`` which one it is about."""

import pytest
from helpers.results_files import read_numbers
from helpers.shared import compute_once, make_folder_once
from helpers.short_holds import plan_roughly, take_two_tools

from affordance.experiments.protocol_runs import load_choice_experiment, load_hold_experiment
from affordance.experiments.runner import run_experiment


@pytest.fixture(scope="module")
def experiment(name, request):
    """The simulation; III and IV are about two of their tools."""
    shared = {"weight": "weight", "hammer": "hammering"}
    if name in shared:
        return request.getfixturevalue(shared[name])
    return load_hold_experiment("com") if name == "com" else take_two_tools(load_choice_experiment("reach"))


@pytest.fixture(scope="module")
def plan(name, experiment, request, tmp_path_factory):
    if name == "hammer":
        return request.getfixturevalue("hammering_plan")
    return compute_once(tmp_path_factory, "reach_plan", lambda: plan_roughly(experiment)) if name == "reach" else None


@pytest.fixture(scope="module")
def folder(name, experiment, plan, tmp_path_factory):
    """Results of the whole simulation with two observers, or three."""
    repeats = 3 if name == "com" else 2

    def fill(folder):
        run_experiment(experiment, plan, folder / name, repeats=repeats, jobs=1)

    return make_folder_once(tmp_path_factory, f"results_{name}", fill) / name


@pytest.fixture(scope="module")
def numbers(folder):
    return read_numbers(folder)
