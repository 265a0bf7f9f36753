import argparse
import json
import math
from dataclasses import replace

import numpy as np
import pytest

from affordance.belief.learner import Learner
from affordance.belief.learners import start_memory
from affordance.commands import fit_kappa, study_people
from affordance.exceptions import BadValueError
from affordance.experiments.people import fit, linear_plus, prediction, results
from affordance.experiments.people.fraction import Fraction, estimate_people_fraction
from affordance.experiments.people.lift_experiment import LiftedObjects, Observers, simulate_observers
from affordance.experiments.people.linear_plus import (
    GROUPS,
    build_experiment,
    list_test_cycles,
)
from affordance.protocols.protocol import load_protocol
from affordance.protocols.published import load_published
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation import clamp_trial
from affordance.simulation.static_lifts import Lift, StaticLifter

HEADER = "quantity,value,low,high,unit,source\n"
TEST = 4


def run_command(command, *options):
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    return command.run(parser.parse_args([str(option) for option in options]))


def exert(group, factor):
    """What one does who goes by the family for the training objects, and by a share of its excess for the test."""
    experiment = build_experiment(group)
    tools = np.array([lift.tool for lift in experiment.draw_lifts(np.random.default_rng(0))])
    weight = 9.81 * np.array([tool.mass for tool in experiment.tools])[tools]
    force = weight.copy()
    force[tools == TEST] = 9.81 * (0.9 + factor * (group.test_mass - 0.9))
    return experiment, LiftedObjects(tools, force, weight)


def test_objects_are_those_that_people_lifted():
    for group, mass in zip(GROUPS, (1.2, 1.5), strict=True):
        tools = build_experiment(group).tools
        np.testing.assert_allclose([tool.mass for tool in tools], [0.6, 0.75, 1.05, 1.2, mass])
        volumes = np.array([tool.components[0].shape.volume for tool in tools])
        cylinders = np.pi * 0.0461**2 * np.array([0.06, 0.075, 0.105, 0.12, 0.09])
        np.testing.assert_allclose(volumes, cylinders, rtol=1e-12)
        assert group.load_people().get("weight_N").value == pytest.approx(9.81 * mass, abs=0.01)


def test_lifts_come_in_cycles_later_with_the_test_object_first():
    tools = [lift.tool for lift in build_experiment(GROUPS[0]).draw_lifts(np.random.default_rng(3))]
    assert len(tools) == 320
    training, later = tools[: 4 * 30], tools[4 * 30 :]
    assert all(sorted(training[k : k + 4]) == [0, 1, 2, 3] for k in range(0, 120, 4))
    assert all(later[k] == TEST and sorted(later[k : k + 5]) == [0, 1, 2, 3, TEST] for k in range(0, 200, 5))
    assert training[:4] != training[4:8] or training[4:8] != training[8:12]


@pytest.mark.parametrize("group", GROUPS)
@pytest.mark.parametrize("factor", [0.0, 0.25, 1.0])
def test_measures_of_one_who_goes_by_a_share_of_the_excess(group, factor):
    experiment, lifted = exert(group, factor)
    found = {name: measure.compute(lifted) for name, measure in experiment.measures.items()}
    force = 9.81 * (0.9 + factor * (group.test_mass - 0.9))
    assert found["first_N"] == pytest.approx(force)
    assert found["end_N"] == pytest.approx(force)
    assert found["family_N"] == pytest.approx(9.81 * 0.9)
    assert found["f"] == pytest.approx(factor, abs=1e-12)
    assert found["training_correlation"] == pytest.approx(1.0)


def test_end_is_the_last_sixteen_cycles_and_the_first_is_the_first():
    experiment, lifted = exert(GROUPS[0], 0.0)
    force = lifted.force.copy()
    of_test = np.flatnonzero(lifted.tool == TEST)
    force[of_test[0]], force[of_test[-17]], force[of_test[-16]] = 1.0, 100.0, force[of_test[-1]] + 16.0
    changed = lifted._replace(force=force)
    assert experiment.measures["first_N"].compute(changed) == 1.0
    assert experiment.measures["end_N"].compute(changed) == pytest.approx(9.81 * 0.9 + 1.0)


def test_family_of_every_cycle_is_that_of_its_own_training_objects():
    experiment, lifted = exert(GROUPS[1], 0.5)
    force = lifted.force * np.append(np.ones(120), np.repeat(np.linspace(1.0, 2.0, 40), 5))
    rows = Observers(lifted.tool[None], force[None], lifted.weight[None], np.zeros((1, 320), dtype=bool))
    test, family = list_test_cycles(experiment, rows)
    assert test.shape == family.shape == (1, 40)
    at = np.flatnonzero(lifted.tool == TEST)[7]
    assert family[0, 7] == pytest.approx(9.81 * 0.9 * force[at + 1] / lifted.weight[at + 1])  # one factor a cycle


def test_people_fractions_are_the_published_ones():
    fractions = [estimate_people_fraction(group.load_people()) for group in GROUPS]
    np.testing.assert_allclose([found.mean for found in fractions], [0.02, 0.69], atol=0.005)
    assert fractions[0].low < 0.0 < fractions[0].high
    assert fractions[1].low > 0.3


def test_error_of_a_fraction_is_that_of_many_drawn_pairs_of_forces():
    people = GROUPS[1].load_people()
    end, family, weight = (people.get(name) for name in ("end_N", "family_N", "weight_N"))
    rng, quantile = np.random.default_rng(1), 2.306  # Student's, 8 degrees of freedom
    ends, families = (
        value.value + (value.high - value.low) / (2.0 * quantile) * rng.standard_normal(200_000)
        for value in (end, family)
    )
    drawn = (ends - families) / (weight.value - families)
    assert estimate_people_fraction(people).se == pytest.approx(drawn.std(), rel=0.05)


def test_fit_finds_the_kappa_that_people_were_made_with():
    """Against the closed form for a learned fraction that falls in a straight line."""
    kappas = np.linspace(0.1, 0.5, 9)
    fractions = np.column_stack([np.zeros(9), 1.5 - 3.0 * kappas])
    people = [Fraction(0.0, 0.1, -0.2, 0.2), Fraction(0.6, 0.12, 0.4, 0.8)]
    found = fit.fit_kappa(kappas, fractions, np.zeros((9, 2)), people)
    assert found.kappa == pytest.approx(0.3, abs=0.001)
    np.testing.assert_allclose([found.low, found.high], 0.3 + np.array([-1.0, 1.0]) * 1.96 * 0.12 / 3.0, atol=0.002)
    assert found.is_bounded
    assert found.log_likelihood.max() == 0.0
    flat = fit.fit_kappa(kappas, np.full((9, 2), 0.6), np.zeros((9, 2)), people)
    assert not flat.is_bounded


def test_error_of_simulated_means_widens_the_interval():
    kappas = np.linspace(0.1, 0.5, 9)
    fractions = np.column_stack([np.zeros(9), 1.5 - 3.0 * kappas])
    people = [Fraction(0.0, 0.1, -0.2, 0.2), Fraction(0.6, 0.12, 0.4, 0.8)]
    exact, rough = (fit.fit_kappa(kappas, fractions, np.full((9, 2), se), people) for se in (0.0, 0.12))
    assert rough.high - rough.low == pytest.approx(math.sqrt(2.0) * (exact.high - exact.low), rel=0.02)


@pytest.fixture(scope="module")
def few():
    """Two observers of each learner in Linear++."""
    experiment = build_experiment(GROUPS[1])
    return experiment, {
        learner: simulate_observers(experiment, learner, DEFAULT_SETTINGS, repeats=2, seed=0, jobs=1)
        for learner in Learner
    }


def test_observers_are_the_same_in_any_number_of_processes(few):
    experiment, observers = few
    again = simulate_observers(experiment, Learner.KINDS_DRAWN, DEFAULT_SETTINGS, repeats=2, seed=0, jobs=2)
    np.testing.assert_array_equal(again.force, observers[Learner.KINDS_DRAWN].force)


def test_observers_are_given_the_same_whatever_they_learn_by(few):
    _, observers = few
    tools = [found.tool for found in observers.values()]
    np.testing.assert_array_equal(tools[0], tools[1])
    np.testing.assert_array_equal(tools[0], tools[2])
    assert not (tools[0][0] == tools[0][1]).all()


def test_one_density_for_each_colour_never_learns_the_odd_object(few):
    experiment, observers = few
    fractions = {learner: found.measure(experiment.measures["f"]) for learner, found in observers.items()}
    np.testing.assert_allclose(fractions[Learner.DENSITY], 0.0, atol=0.02)
    # Simulated with a narrow category, the odd object is a thing of its own at once.
    narrow = simulate_observers(
        experiment, Learner.KINDS_MAP, DEFAULT_SETTINGS, repeats=2, seed=0, jobs=1, kappa=0.12
    )
    np.testing.assert_allclose(narrow.measure(experiment.measures["f"]), 1.0, atol=0.1)


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


def test_learned_fraction_does_not_depend_on_the_scale_of_densities():
    """Linear++ with all volumes five times as large, and a fifth: shorter, eight observers."""
    experiment = build_experiment(GROUPS[1])
    lifts = [lift.tool for lift in experiment.draw_lifts(np.random.default_rng(0))]
    lifts = [Lift(tool) for tool in (*lifts[:20], *lifts[120:180])]
    last = [k for k, lift in enumerate(lifts) if lift.tool == TEST][-6:]
    fractions = {}
    for factor in (1.0, 5.0, 0.2):
        lifter = StaticLifter(multiply_densities(experiment.tools, factor), DEFAULT_SETTINGS)
        forces = [
            lifter.run(lifts, start_memory(Learner.KINDS_MAP, (seed,), 0.22), (seed, 1)).force[last].mean()
            for seed in range(8)
        ]
        fractions[factor] = np.mean(np.array(forces) / 9.81 - 0.9) / 0.6
    assert fractions[1.0] > 0.5
    for factor in (5.0, 0.2):
        assert fractions[factor] == pytest.approx(fractions[1.0], abs=0.35)  # of eight observers, two standard errors


def test_needless_kinds_are_those_founded_by_honest_objects_at_first_sight():
    tool = np.array([[0, 1, 2, 1, 3], [1, 0, 0, 2, 3]])
    founded = np.array([[True, True, False, False, True], [True, False, True, False, True]])
    observers = Observers(tool, np.ones((2, 5)), np.ones((2, 5)), founded)
    assert observers.count_needless_kinds((0, 1, 2)) == (1, 4)


@pytest.fixture
def shorter(monkeypatch):
    """A third of the lifts."""

    def load(path):
        protocol = load_protocol(path)
        counts = zip(protocol.blocks, (5, 16), strict=True)
        blocks = [block.model_copy(update={"repetitions": count}) for block, count in counts]
        return protocol.model_copy(update={"blocks": blocks})

    monkeypatch.setattr(linear_plus, "load_protocol", load)


def test_metrics_have_exactly_the_keys_that_are_asked_for(tmp_path, capsys, monkeypatch, shorter):
    monkeypatch.setattr(study_people, "GROUPS", GROUPS[1:])
    monkeypatch.setattr(clamp_trial, "_FACTORS", np.array([0.4, 1.0, 1.6]))
    assert run_command(study_people, "--repeats", 2, "--jobs", 1, "--out", tmp_path) == 0
    keys = {name + suffix for name in ("first_N", "end_N", "family_N", "f") for suffix in ("", "_ci95")}
    for group in GROUPS[1:]:
        numbers = json.loads((tmp_path / group.name / "metrics.json").read_text())
        assert set(numbers["learners"]) == {"density", "kinds_map", "kinds_drawn"}
        for row in (*numbers["learners"].values(), numbers["people"]):
            assert set(row) == keys
            for name in ("first_N", "end_N", "family_N", "f"):
                low, high = row[f"{name}_ci95"]
                assert low <= row[name] <= high
        assert set(numbers["kappa"]) == {"kinds_map", "kinds_drawn"}
        assert numbers["people"]["first_N"] == group.load_people().get("first_N").value
        for suffix in ("png", "svg"):
            assert (tmp_path / group.name / f"test_object.{suffix}").stat().st_size > 10_000
        section = results.describe(group, numbers, 2)
        assert len(section.claims) == 9
        for claim in section.claims:
            (found,) = claim.criteria
            low, high = (float(each.split()[2]) for each in found.bound.split(" and "))
            assert claim.met == (low <= float(found.value.split()[0]) <= high)
    assert "Linear++, 2 observers" in capsys.readouterr().out


def test_fit_command_writes_what_it_found(tmp_path, capsys, shorter):
    options = ("--repeats", 2, "--count", 3, "--lowest", 0.15, "--highest", 0.35, "--jobs", 1, "--out", tmp_path)
    assert run_command(fit_kappa, *options) == 0
    numbers = json.loads((tmp_path / "kappa" / "metrics.json").read_text())
    for learner in ("kinds_map", "kinds_drawn"):
        assert numbers["learners"][learner]["kappas"] == pytest.approx([0.15, 0.25, 0.35])
        assert (tmp_path / "kappa" / f"{learner}.png").stat().st_size > 10_000
        assert f"{learner}: kappa" in capsys.readouterr().out or learner == "kinds_drawn"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--lowest", 0.5), "--lowest: is 0.5, must be more than 0 and less than --highest, 0.48"),
        (("--lowest", 0), "--lowest: is 0, must be more than 0"),
        (("--count", 2), "--count: is 2, must be at least 3"),
        (("--repeats", 1), "--repeats: is 1, must be at least 2"),
    ],
)
def test_fit_command_names_bad_options(options, message, tmp_path):
    with pytest.raises(BadValueError, match=message):
        run_command(fit_kappa, *options, "--out", tmp_path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "row 1: names the columns nothing, must be quantity, value, low, high, unit, source"),
        ("quantity,value\n", "row 1: names the columns quantity, value, must be"),
        (HEADER + "f,1,0\n", "row 2: has 3 columns, must have 6"),
        (HEADER + "f,abc,,,1,x\n", "row 2, value: is 'abc', must be a finite number"),
        (HEADER + "f,1,0,nan,1,x\n", "row 2, high: is 'nan', must be a finite number"),
        (HEADER + "f,1,0,,1,x\n", "row 2, high: is empty, must be given as the other end is"),
        (HEADER + "f,1,2,3,1,x\n", "row 2, low: is 2, must be at most the value 1"),
        (HEADER + "f,1,0,0.5,1,x\n", "row 2, high: is 0.5, must be at least the value 1"),
        (HEADER + "f,1,,,,x\n", "row 2, unit: is empty, must be given"),
        (HEADER + "f,1,,,1, \n", "row 2, source: is empty, must be given"),
        (HEADER + "f,1,,,1,x\nf,2,,,1,x\n", "row 3, quantity: is 'f', which an earlier row has"),
        (HEADER + ",1,,,1,x\n", "row 2, quantity: is '', must be a name"),
        (HEADER + 'f,1,,,1,"x\n', "is not a table of comma-separated values"),
    ],
)
def test_tables_of_people_name_what_is_wrong(text, message, tmp_path):
    path = tmp_path / "people.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(BadValueError) as error:
        load_published(path)
    assert f"people.csv: {message}" in str(error.value)
    assert "\n" not in str(error.value)


def test_tables_of_people_name_what_is_missing(tmp_path):
    path = tmp_path / "people.csv"
    with pytest.raises(BadValueError, match="cannot be read: No such file"):
        load_published(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(BadValueError, match="is not a text file in UTF-8"):
        load_published(path)
    path.write_text(HEADER + "frist_N,1,,,N,x\n")
    with pytest.raises(BadValueError, match=r"has no row 'first_N', which is needed; .* nearest is 'frist_N'"):
        load_published(path).get("first_N")


def test_predictions_say_which_measure_tells_learners_apart(few):
    experiment, observers = few
    predictions = {
        name: {learner: prediction.summarise(found.measure(measure)) for learner, found in observers.items()}
        for name, measure in experiment.measures.items()
    }
    contrasts = prediction.contrast_learners(predictions, dict.fromkeys(predictions, 0.5))
    assert [abs(c.effect) for c in contrasts] == sorted((abs(c.effect) for c in contrasts), reverse=True)
    text = prediction.format_predictions(
        {name: measure.meaning for name, measure in experiment.measures.items()}, predictions, contrasts
    )
    assert "density and kinds_map are told apart best by" in text
    assert text.count("nine in ten") == len(Learner) * len(experiment.measures)


def test_contrasts_are_those_of_two_normal_samples():
    rng = np.random.default_rng(5)
    one, other = rng.normal(0.0, 1.0, 1000), rng.normal(1.0, 1.0, 1000)
    predictions = {"m": {Learner.DENSITY: prediction.summarise(one), Learner.KINDS_MAP: prediction.summarise(other)}}
    (contrast,) = prediction.contrast_learners(predictions)
    assert contrast.effect == pytest.approx(1.0, abs=0.1)
    assert contrast.superiority == pytest.approx(0.760, abs=0.03)  # Phi(1 / sqrt 2)
    assert contrast.num_people == pytest.approx(22, abs=4)  # 2 (1.960 + 1.282)^2
    (wider,) = prediction.contrast_learners(predictions, {"m": math.sqrt(3.0)})
    assert wider.effect == pytest.approx(0.5 * contrast.effect, rel=0.03)
    assert wider.superiority == pytest.approx(0.638, abs=0.03)


def test_learners_that_do_the_same_are_not_told_apart():
    same = {learner: prediction.summarise(np.ones(5)) for learner in (Learner.DENSITY, Learner.KINDS_MAP)}
    (contrast,) = prediction.contrast_learners({"first_N": same})
    assert contrast.superiority == 0.5
    assert math.isinf(contrast.num_people)
    text = prediction.format_predictions({}, {"first_N": same}, [contrast])
    assert "density and kinds_map are not told apart by any of these" in text
