import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.refusals import refuse_command
from helpers.results_files import read_numbers
from helpers.study_runs import run_study

from affordance.belief.learners import KINDS_DRAWN, KINDS_MAP
from affordance.experiments.shared.holds import compute_volume
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments import lifts, linear
from affordance.extensions.people.experiments.linear import GROUPS
from affordance.extensions.people.static_lifts import StaticLifter
from affordance.settings import DEFAULT_SETTINGS
from studies.people import command, fit
from studies.people.fit import Fraction, estimate_people_fraction

PLUS, PLUS_PLUS = GROUPS.values()
TOOLS = {name: linear.make_objects(name) for name in GROUPS}
TRIALS = linear.design(0, np.random.default_rng(0))


def lift(name, factor):
    """Lifts of one who exerts the weight of training objects, and for the test object 0.9 kg and a share of more."""
    table = TRIALS[["object"]].reset_index(drop=True)
    mass = table["object"].map({tool.name: tool.mass for tool in TOOLS[name]})
    force = 9.81 * mass.where(table["object"] != "test", 0.9 + factor * (mass - 0.9))
    size = table["object"].map({tool.name: compute_volume(tool) for tool in TOOLS[name]})
    return table.assign(force=force, weight=9.81 * mass, size=size)


@pytest.mark.parametrize("name", GROUPS)
def test_objects_are_those_that_people_lifted(name):
    masses = [0.6, 0.75, 1.05, 1.2, GROUPS[name].mass]
    np.testing.assert_allclose([tool.mass for tool in TOOLS[name]], masses)
    volumes = [compute_volume(tool) for tool in TOOLS[name]]
    np.testing.assert_allclose(volumes, np.pi * 0.0461**2 * np.array([0.06, 0.075, 0.105, 0.12, 0.09]), rtol=1e-12)
    assert GROUPS[name].people["weight_N"].value == pytest.approx(9.81 * masses[-1], abs=0.01)


def test_lifts_come_in_cycles_later_with_the_test_object_first():
    names, family = list(TRIALS["object"]), sorted(linear.TRAINING)
    assert len(names) == 320
    training, later = names[: 4 * 30], names[4 * 30 :]
    assert all(sorted(training[k : k + 4]) == family for k in range(0, 120, 4))
    assert all(later[k] == "test" and sorted(later[k + 1 : k + 5]) == family for k in range(0, 200, 5))
    assert training[:4] != training[4:8] or training[4:8] != training[8:12]


@pytest.mark.parametrize("name", GROUPS)
@pytest.mark.parametrize("factor", [0.0, 0.25, 1.0])
def test_measures_of_one_who_goes_by_a_share_of_the_excess(name, factor):
    found = linear.measure(lift(name, factor))
    force = 9.81 * (0.9 + factor * (GROUPS[name].mass - 0.9))
    assert found["first_N"] == pytest.approx(force)
    assert found["end_N"] == pytest.approx(force)
    assert found["family_N"] == pytest.approx(9.81 * 0.9)
    assert found["f"] == pytest.approx(factor, abs=1e-12)
    assert found["training_correlation"] == pytest.approx(1.0)


def test_end_is_the_last_sixteen_cycles_and_the_first_is_the_first():
    table = lift("linear_plus", 0.0)
    of_test = np.flatnonzero(table["object"] == "test")
    last = table.loc[of_test[-1], "force"]
    table.loc[of_test[[0, -17, -16]], "force"] = [1.0, 100.0, last + 16.0]
    found = linear.measure(table)
    assert found["first_N"] == 1.0
    assert found["end_N"] == pytest.approx(9.81 * 0.9 + 1.0)


def test_people_fractions_are_the_published_ones():
    fractions = [estimate_people_fraction(group) for group in GROUPS.values()]
    np.testing.assert_allclose([found.mean for found in fractions], [0.02, 0.69], atol=0.005)
    assert fractions[0].low < 0.0 < fractions[0].high
    assert fractions[1].low > 0.3


def test_error_of_a_fraction_is_that_of_many_drawn_pairs_of_forces():
    end, family, weight = (PLUS_PLUS.people[name] for name in ("end_N", "family_N", "weight_N"))
    rng, quantile = np.random.default_rng(1), 2.306  # Student's, 8 degrees of freedom
    ends, families = (
        value.value + (value.high - value.low) / (2.0 * quantile) * rng.standard_normal(200_000)
        for value in (end, family)
    )
    drawn = (ends - families) / (weight.value - families)
    assert estimate_people_fraction(PLUS_PLUS).se == pytest.approx(drawn.std(), rel=0.05)


KAPPAS = np.linspace(0.1, 0.5, 9)
FRACTIONS = np.column_stack([np.zeros(9), 1.5 - 3.0 * KAPPAS])
PEOPLE = [Fraction(0.0, 0.1, -0.2, 0.2), Fraction(0.6, 0.12, 0.4, 0.8)]


def test_fit_finds_the_kappa_that_people_were_made_with():
    """The fitted kappa agrees with the closed form for a learned fraction that is linear in kappa."""
    found = fit.fit_kappa(KAPPAS, FRACTIONS, np.zeros((9, 2)), PEOPLE)
    assert found.kappa == pytest.approx(0.3, abs=0.001)
    np.testing.assert_allclose([found.low, found.high], 0.3 + np.array([-1.0, 1.0]) * 1.96 * 0.12 / 3.0, atol=0.002)
    assert found.is_bounded
    assert found.log_likelihood.max() == 0.0
    flat = fit.fit_kappa(KAPPAS, np.full((9, 2), 0.6), np.zeros((9, 2)), PEOPLE)
    assert not flat.is_bounded


def test_error_of_simulated_means_widens_the_interval():
    exact, rough = (fit.fit_kappa(KAPPAS, FRACTIONS, np.full((9, 2), se), PEOPLE) for se in (0.0, 0.12))
    assert rough.high - rough.low == pytest.approx(math.sqrt(2.0) * (exact.high - exact.low), rel=0.02)


@pytest.fixture
def few(monkeypatch):
    """An eighth of the lifts."""
    monkeypatch.setattr(linear, "FAMILIAR", 1)
    monkeypatch.setattr(linear, "MIXED", 8)


@pytest.mark.parametrize(("kappa", "fraction"), [(8.0, 0.0), (0.12, 1.0)])
def test_a_broad_category_never_learns_the_odd_object_and_a_narrow_one_does_at_once(kappa, fraction):
    setup = Setup().change(learner=KINDS_MAP)
    changed = setup.change(learner=setup.settings.learner.change(kappa=kappa))
    (found,) = fit.find_fractions(changed, TOOLS["linear_plus_plus"], [0])
    assert found == pytest.approx(fraction, abs=0.1)


@pytest.mark.parametrize("learner", [KINDS_MAP, KINDS_DRAWN])
def test_observers_are_those_of_the_experiment(few, learner):
    """With the fitted kappa the fraction of an observer is that of ``affordance run``, to the last bit."""
    setup, tools = Setup().change(learner=learner), TOOLS["linear_plus_plus"]
    (data,) = lifts.lift(setup, tools, linear.design, [0])
    table = data.to_dataframe()
    table["size"] = table["object"].map({tool.name: compute_volume(tool) for tool in tools})
    assert fit.find_fractions(setup, tools, [0]) == [linear.measure(table)["f"]]


def multiply_densities(tools, factor):
    """Objects of the same weights and looks, a factor denser, and so smaller."""
    scaled = []
    for tool in tools:
        (part,) = tool.components
        material = replace(part.material, density=factor * part.material.density)
        shape = part.shape.with_sizes(np.array(part.shape.sizes) * factor ** (-1.0 / 3.0))
        made = replace(part, shape=shape, material=material, looks_like=material)
        scaled.append(replace(tool, components=(made,)))
    return scaled


@pytest.mark.parametrize("learner", [KINDS_MAP, KINDS_DRAWN])
def test_learned_fraction_does_not_depend_on_the_scale_of_densities(learner):
    """Mean learned fractions of 200 observers agree to 0.02 for densities five times as large and as small.

    Observers feel with the same errors, and draw the same numbers. Lifts are fewer than in the experiment.
    """
    tools = TOOLS["linear_plus_plus"]
    names = [tool.name for tool in tools]
    held = [names.index(each) for each in TRIALS["object"]]
    some = [*held[:20], *held[120:180]]
    last = [k for k, each in enumerate(some) if each == names.index("test")][-6:]
    seeds = [(seed, 1) for seed in range(200)]
    fractions = {}
    for factor in (1.0, 5.0, 0.2):
        lifter = StaticLifter(multiply_densities(tools, factor), replace(DEFAULT_SETTINGS, learner=learner))
        errors = lifter.draw_errors(seeds, len(some))
        record = lifter.run(np.tile(np.array(some)[:, None], len(seeds)), lifter.start(seeds), errors, seeds)
        fractions[factor] = np.mean(record.force[last] / 9.81 - 0.9) / 0.6
    assert 0.3 < fractions[1.0] < 0.9
    for factor in (5.0, 0.2):
        assert fractions[factor] == pytest.approx(fractions[1.0], abs=0.02)


def test_command_writes_what_it_found(few, tmp_path, capsys):
    options = ("--repeats", 2, "--count", 3, "--lowest", 0.15, "--highest", 0.35, "--jobs", 1, "--out", tmp_path)
    assert run_study(command.STUDY, *options) == 0
    numbers = read_numbers(tmp_path / "kappa")
    for learner in ("kinds_map", "kinds_drawn"):
        assert numbers["learners"][learner]["kappas"] == pytest.approx([0.15, 0.25, 0.35])
        assert (tmp_path / "kappa" / f"{learner}.png").stat().st_size > 10_000
        assert f"{learner}: kappa" in capsys.readouterr().out or learner == "kinds_drawn"


def test_command_compares_volumes_and_would_show_a_difference(capsys, monkeypatch):
    """A test object that becomes lighter with its volume joins the family."""
    setup, scale = Setup(observers=6, seed=1), command.scale_volume
    found = []
    for share in (1.0, 0.8):
        monkeypatch.setattr(
            command,
            "scale_volume",
            lambda tool, factor, share=share: scale(
                lifts.cylinder(
                    tool.name,
                    radius=linear.RADIUS,
                    height=tool.components[0].shape.sizes[1],
                    mass=tool.mass * (share if tool.name == "test" and factor != 1.0 else 1.0),
                ),
                factor,
            ),
        )
        command.compare_volumes(setup, [1.0, 0.2])
        lines = [line for line in capsys.readouterr().out.splitlines() if "minus" in line]
        found.append([abs(float(line.split(": ")[1].split(" ")[0])) for line in lines])
    np.testing.assert_array_less(found[0], 0.02)
    assert max(found[1]) > 0.05


def test_volumes_out_of_bounds_are_refused():
    said = refuse_command("study", "people", "--volumes", "0.001")
    assert said.endswith("--volumes: is 0.001, must be from 0.01 to 100; the nearest is 0.01")
