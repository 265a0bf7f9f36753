"""Linear+ and Linear++: objects, trials, and the numbers of one observer by hand."""

import numpy as np
import pandas as pd
import pytest
from helpers.results_files import read_section
from scipy.stats import t as student_t

from affordance.belief.learners import DENSITY, KINDS_DRAWN, KINDS_MAP
from affordance.belief.prior import Prior
from affordance.experiments.shared.holds import compute_volume
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments import linear
from affordance.extensions.people.experiments.lifts import cylinder, lift
from affordance.extensions.people.experiments.linear import Published, describe_people, find_spread

G = 9.81  # [m/s^2]


@pytest.mark.parametrize(("experiment", "share"), [(linear.LINEAR_PLUS, 1 / 3), (linear.LINEAR_PLUS_PLUS, 2 / 3)])
def test_test_object_is_heavier_than_its_size_predicts(experiment, share):
    *family, test = experiment.read(Setup())
    densities = [tool.mass / compute_volume(tool) for tool in family]
    assert densities == pytest.approx([densities[0]] * 4, rel=1e-12)
    assert test.mass / (densities[0] * compute_volume(test)) == pytest.approx(1.0 + share, rel=1e-12)
    sizes = sorted(map(compute_volume, family))
    assert sizes[1] < compute_volume(test) < sizes[2]
    assert densities[0] * compute_volume(test) * G == pytest.approx(linear.PREDICTED, rel=1e-3)
    assert {part.looks_like.colour for tool in (*family, test) for part in tool.components} == {
        test.components[0].looks_like.colour
    }


def test_family_comes_first_and_then_the_test_object_at_the_head_of_each_cycle():
    trials = linear.design(0, np.random.default_rng(0))
    assert len(trials) == 4 * 30 + 5 * 40
    family = trials[trials["block"] == "family"]
    assert "test" not in set(family["object"])
    mixed = trials[trials["block"] == "odd member"]
    assert mixed["object"].tolist()[::5] == ["test"] * 40
    for _, cycle in trials.groupby(["block", "cycle"]):
        assert cycle["object"].is_unique


def test_numbers_of_one_observer_by_hand():
    """The family is lifted by 10 N/m of height, so that its line at the test object's size is 0.9 N off zero."""
    rows = []
    for _ in range(40):
        rows += [("test", 0.09, 12.0, 0.0)]
        rows += [(name, height, 100.0 * height, 100.0 * height + 1.0) for name, height in linear.TRAINING.items()]
    early = [(name, height, 100.0 * height, 100.0 * height) for name, height in linear.TRAINING.items()] * 30
    lifts = pd.DataFrame([*early, *rows], columns=["object", "size", "weight", "force"])
    lifts.loc[lifts["object"] == "test", "force"] = [7.0, *[20.0] * 23, *[10.0, 12.0] * 8]
    found = linear.measure(lifts)
    assert found["weight_N"] == 12.0
    assert found["first_N"] == 7.0
    assert found["end_N"] == pytest.approx(11.0)
    assert found["family_N"] == pytest.approx(10.0)
    assert found["f"] == pytest.approx(0.5)
    assert found["training_correlation"] == pytest.approx(1.0)


def test_learned_fraction_of_people_has_an_interval_by_its_parts():
    """Forces of 0 -+ 1 N for the family and 5 -+ 1 N at the end of 10 N make f 0.5 -+ 0.1 and -+ 0.05."""
    group = linear.GROUPS["linear_plus"]._replace(
        people={
            **linear.GROUPS["linear_plus"].people,
            "weight_N": Published(10.0),
            "end_N": Published(5.0, 4.0, 6.0),
            "family_N": Published(0.0, -1.0, 1.0),
        }
    )
    f = linear.list_people(group)["f"]
    half = np.hypot(0.1, 0.05)
    assert f == pytest.approx((0.5, 0.5 - half, 0.5 + half))


@pytest.mark.parametrize("name", ["linear_plus", "linear_plus_plus"])
def test_people_stand_beside_every_learner(get_shipped, name):
    run = get_shipped(name)
    (table,) = read_section(run.folder).tables
    assert [row[0] for row in table["rows"]][-1] == "people"
    assert len(table["rows"]) == 4
    assert run.numbers["people"]["first_N"] == linear.GROUPS[name].people["first_N"].value
    assert run.numbers["first_N"] == run.numbers["learners"]["density"]["first_N"]
    assert len(run.lifts) == 2 * 3 * 320


def test_what_the_paper_says_of_both_groups_is_seen(get_shipped):
    """One density for each colour learns less of the test object's own weight than kinds, more so in Linear++."""
    by_density, by_kinds = (
        [get_shipped(name).numbers["learners"][learner]["f"] for name in ("linear_plus", "linear_plus_plus")]
        for learner in ("density", "kinds_drawn")
    )
    assert by_density[1] < by_kinds[1]
    assert by_kinds[0] < by_kinds[1]


@pytest.mark.parametrize("learner", [KINDS_MAP, KINDS_DRAWN, DENSITY], ids=lambda learner: learner.name)
@pytest.mark.parametrize("factor", [0.2, 5.0])
def test_objects_of_the_same_weights_are_lifted_alike_whatever_their_volumes(learner, factor):
    """Forces of the same observers agree lift by lift, if the prior of what was never felt is as dense."""
    tools, forces = linear.make_objects("linear_plus_plus"), []
    for volume in (1.0, factor):
        prior = Prior(mode=1000.0 / volume, sd=4000.0 / volume)
        scaled = [scale_volume(tool, volume) for tool in tools]
        found = lift(Setup(seed=1).change(learner=learner, prior=prior), scaled, linear.design, range(4))
        forces.append([observer["force"].to_numpy() for observer in found])
    np.testing.assert_allclose(forces[1], forces[0], rtol=1e-7)
    assert (np.ptp(forces[0], axis=0) > 0.01).all()  # observers differ


def scale_volume(tool, factor):
    """Makes a cylinder of the same mass that is larger by a factor of its volume."""
    ((radius, height),) = (part.shape.sizes for part in tool.components)
    size = factor ** (1.0 / 3.0)
    return cylinder(tool.name, radius=radius * size, height=height * size, mass=tool.mass)


def test_learned_fraction_just_below_zero_has_no_sign():
    own = dict.fromkeys(("first_N", "end_N", "family_N"), 9.0) | {"f": -1e-4}
    own |= {f"{key}_ci95": (value, value) for key, value in own.items()}
    table = linear.tabulate({"learners": {"density": own}, "people": own})
    assert table["learned fraction f"].tolist() == ["0.00 [0.00, 0.00]"] * 2


def test_values_have_their_interval_where_one_is_published():
    people = {"end_N": Published(9.0, 8.0, 10.0), "weight_N": Published(11.77)}
    assert describe_people(people) == {"end_N": 9.0, "end_N_ci95": [8.0, 10.0], "weight_N": 11.77}


def test_spread_follows_from_the_interval_of_the_mean():
    """A 95 % interval of +- 0.945 N over nine people is an SD of 0.945 / 2.306 * 3."""
    assert find_spread(Published(8.13, 7.19, 9.08), 9, "a paper").sd == pytest.approx(0.945 / 2.306 * 3.0, rel=1e-4)
    rng = np.random.default_rng(0)
    drawn = rng.normal(10.0, 2.0, 14)
    half = student_t.ppf(0.975, 13) * drawn.std(ddof=1) / np.sqrt(14)
    found = find_spread(Published(10.0, 10.0 - half, 10.0 + half), 14, "a paper")
    assert (found.sd, found.source) == (pytest.approx(drawn.std(ddof=1)), "a paper")
