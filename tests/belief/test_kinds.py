import numpy as np
import pytest

from affordance.belief.density_belief import Prior
from affordance.belief.holds import Felt, add_hold
from affordance.belief.kinds import (
    KindPrior,
    add_kinds,
    believe_kinds,
    close_gaps,
    count_things,
    find_most_populous,
    find_specimens,
    find_twins,
    infer_kind,
    infer_kinds,
    make_room_for_thing,
    merge,
    select_colours,
    start_kinds,
    tidy,
)
from affordance.belief.kinds_gate import adopt, predict_new, weigh
from affordance.belief.learner import Seen, describe_start
from affordance.belief.learners import KINDS_DRAWN, KINDS_MAP
from affordance.belief.likelihood import Likelihood
from affordance.belief.rows import take_rows

PRIOR = Prior(mode=1000.0, sd=4000.0, deviation=0.06)
FIRST = (1000.0, 4000.0)


def build(colours, priors=None):
    """The state of one observer with kinds of colours."""
    everywhere = np.ones((1, len(colours)), dtype=bool)
    starts = [KindPrior(*(np.array([each]) for each in prior)) for prior in priors or [FIRST] * len(colours)]
    state = start_kinds(0, KindPrior(np.array([PRIOR.mode]), np.array([PRIOR.sd])))
    return {**describe_start(KINDS_MAP.parameters, PRIOR, 1), **add_kinds(state, colours, starts, everywhere)}


def believe(state, mean, covariance):
    """The state with another belief about the means of its kinds."""
    return {**state, "mean": np.array([mean], dtype=float), "covariance": np.array([covariance], dtype=float)}


def populate(state, kinds):
    """Adds things of one colour each, by the kind of each."""
    column = np.array(kinds, dtype=np.intp).reshape(1, -1, 1)
    zeros = np.zeros(column.shape)
    return {
        **state,
        "thing_kind": column,
        "num_lifts": np.full(column.shape, 2, dtype=np.intp),
        "probability": zeros + 0.9,
        "is_own": zeros.astype(bool),
        "own_mean": zeros,
        "own_covariance": zeros[..., None],
    }


def teach(state, lifts):
    """Adds a thing for each lift: density, its error, and the kind of the thing."""
    state = populate(state, [kind for *_, kind in lifts])
    for number, (density, sd, _) in enumerate(lifts):
        felt = Felt.from_quadratic(Likelihood(np.array([[sd**-2]]), np.array([density * sd**-2]), 0.0))
        state, specimens = find_specimens(state, np.array([number]))
        state = add_hold(state, Seen((0,), specimens), felt)
    return state


LAST = np.zeros(1, dtype=np.intp)  # number of the thing that was held last, of one observer


def stack(states):
    return {name: np.concatenate([each[name] for each in states]) for name in states[0]}


def test_merged_kinds_believe_what_one_kind_would_have_learned():
    lifts = [(5000.0, 300.0, 0), (5100.0, 150.0, 1), (2000.0, 200.0, 2), (4900.0, 250.0, 1)]
    apart = teach(build((0, 0, 1), [FIRST, (5500.0, 11_000.0), FIRST]), lifts)
    merged = close_gaps(merge(apart, np.array([0]), np.array([0]), np.array([1])))
    together = teach(build((0, 1)), [(*lift[:2], kind) for lift, kind in zip(lifts, (0, 0, 1, 0), strict=True)])
    for name in ("kind_colour", "kind_mean", "kind_sd", "thing_kind"):
        np.testing.assert_array_equal(merged[name], together[name])
    one, other = (believe_kinds(infer_kinds(each, LAST)[0]) for each in (merged, together))
    np.testing.assert_allclose(one.mean, other.mean, rtol=1e-12)
    np.testing.assert_allclose(one.covariance, other.covariance, rtol=1e-12)


@pytest.mark.parametrize(("difference", "are_twins"), [(0.0, True), (290.0, True), (330.0, False), (900.0, False)])
def test_twins_differ_by_less_than_objects_of_one_material(difference, are_twins):
    state = believe(build((0, 1, 0)), [5000.0, 4000.0, 5000.0 + difference], 10.0**2 * np.eye(3))
    one, other, found = find_twins(state)
    assert found.tolist() == [are_twins]
    assert not are_twins or (one[0], other[0]) == (0, 2)


def test_kinds_of_different_colours_are_no_twins():
    assert not find_twins(believe(build((0, 1)), [5000.0, 5000.0], np.eye(2)))[2]


def test_kinds_about_which_little_is_known_are_no_twins():
    assert not find_twins(infer_kinds(teach(build((0, 0)), [(5000.0, 300.0, 0), (5000.0, 300.0, 1)]), LAST)[0])[2]


TWINS = [(5000.0, 30.0, k % 2) for k in range(16)]


def test_twins_become_one_and_its_members_leave_no_trace():
    state = teach(build((0, 0)), TWINS)
    state["is_own"][0, 2], state["own_mean"][0, 2], state["own_covariance"][0, 2] = True, 5000.0, 400.0
    tidied, _ = tidy(state, LAST)
    assert tidied["kind_colour"].tolist() == [[0]]
    assert not tidied["is_own"].any()
    assert not tidied["own_mean"].any()


def test_a_forgotten_kind_leaves_the_others_as_they_were():
    priors = [FIRST, (5000.0, 10_000.0), (3000.0, 6000.0)]
    tidied, _ = tidy(teach(build((0, 0, 1), priors), [(5000.0, 300.0, 0), (3000.0, 300.0, 2)]), LAST)
    assert tidied["kind_colour"].tolist() == [[0, 1]]
    assert [*zip(*(tidied[name][0].tolist() for name in ("kind_mean", "kind_sd")), strict=True)] == [FIRST, priors[2]]
    without = teach(build((0, 1), [FIRST, priors[2]]), [(5000.0, 300.0, 0), (3000.0, 300.0, 1)])
    expected = believe_kinds(infer_kinds(without, LAST)[0])
    np.testing.assert_allclose(believe_kinds(tidied).mean, expected.mean, rtol=1e-12)
    np.testing.assert_allclose(believe_kinds(tidied).covariance, expected.covariance, rtol=1e-12)
    assert tidied["thing_kind"][0, :, 0].tolist() == [0, 1]


def test_a_colour_never_lifted_keeps_its_kind():
    assert tidy(teach(build((0, 1)), [(5000.0, 100.0, 0)]), LAST)[0]["kind_colour"].tolist() == [[0, 1]]


def test_observers_are_tidied_each_for_itself():
    """Twins, a forgotten kind, and neither: of three observers each is as if it were alone."""
    apart = [(5000.0, 30.0, 0), (900.0, 30.0, 1)] * 8
    kinds = [TWINS, [(density, sd, 2 * (kind == 1)) for density, sd, kind in apart], apart]
    alone = [teach(build((0, 0, 0)), lifts) for lifts in kinds]
    together, _ = tidy(stack(alone), np.zeros(3, dtype=np.intp))
    for row, each in enumerate(tidy(one, LAST)[0] for one in alone):
        count = int(each["is_kind"].sum())
        assert together["is_kind"][row].sum() == count
        np.testing.assert_allclose(believe_kinds(together).mean[row, :count], believe_kinds(each).mean[0], rtol=1e-9)
        np.testing.assert_array_equal(together["thing_kind"][row], each["thing_kind"][0])
    assert together["is_kind"].sum(axis=1).tolist() == [1, 2, 2]


def test_what_a_hold_leaves_unchanged_need_not_be_inferred_again():
    """Three pairs of equal observers of two things, which change their kinds, lift by lift: as from all holds."""
    size, rng = 6, np.random.default_rng(0)
    prior = KindPrior(np.full(size, PRIOR.mode), np.full(size, PRIOR.sd))
    state = {**describe_start(KINDS_DRAWN.parameters, PRIOR, size), **start_kinds(1, prior)}
    counts = set()
    for number in range(12):
        seen = Seen((0,), np.tile([number % 2, (number + 1) % 2, number // 2 % 2], 2))
        density = np.tile(np.where(seen.things[:3] == 0, 5000.0, 8000.0) + rng.normal(0.0, 500.0, 3), 2)
        tau = density[:, None] * 1e-3
        felt = Felt.from_torques(tau, np.zeros(1), np.full((size, 1, 1), 1e-3), (0.5, 0.0))
        state = make_room_for_thing(state, seen)
        verdicts = weigh(state, seen, felt)
        first = np.searchsorted(verdicts.hypotheses.observers, np.arange(size))
        state = adopt(state, seen, verdicts, first + np.tile(rng.integers(2, size=3), 2), felt).state
        counts |= set(state["is_kind"].sum(axis=1).tolist())
        again, own = infer_kinds(state, seen.things)
        np.testing.assert_allclose(state["mean"], again["mean"], rtol=1e-12)
        np.testing.assert_allclose(state["covariance"], again["covariance"], rtol=1e-12)
        np.testing.assert_allclose(infer_kind(state, seen.things)[1].mean, own.mean, rtol=1e-12)
        alone = [
            infer_kinds(take_rows(state, np.array([row])), seen.things[[row]])[0]["mean"][0] for row in range(size)
        ]
        np.testing.assert_allclose(again["mean"], alone, rtol=1e-12)
    assert counts >= {1, 2}


def test_things_are_counted_by_kind_with_or_without_one_of_them():
    state = populate(build((0, 0, 1)), [1, 1, 0, 2])
    state["num_lifts"][0, 1] = 0  # never lifted
    assert count_things(state).tolist() == [[1, 1, 1]]
    assert count_things(state, np.array([0])).tolist() == [[1, 0, 1]]


def test_the_most_populous_kind_has_most_objects_and_of_equals_is_the_oldest():
    state = build((0, 0, 1))
    assert find_most_populous(populate(state, [1, 1, 0]), (0,)).tolist() == [[1]]
    assert find_most_populous(populate(state, [1, 0, 2, 2]), (0, 1)).tolist() == [[0, 2]]


@pytest.mark.parametrize(
    ("mean", "sd", "scale"), [(0.0, 400.0, 400.0), (-300.0, 400.0, 500.0), (5000.0, 0.0, 5000.0)]
)
def test_a_further_kind_has_the_scale_of_what_the_most_populous_may_weigh(mean, sd, scale):
    """It is sqrt(mean^2 + sd^2): of a kind that was hardly felt, a mean near zero or below it tells no scale."""
    state = populate(believe(build((0, 1)), [mean, 7000.0], np.diag([sd + 1e-6, 300.0]) ** 2), [0, 0])
    (further, first), is_further = predict_new(state, (0, 1))
    assert (further.mean[0], further.sd[0]) == pytest.approx((scale, 2.0 * scale))
    assert (first.mean[0], first.sd[0]) == FIRST
    assert is_further.tolist() == [[True, False]]


@pytest.mark.parametrize(("sd", "are_twins"), [(435.0, True), (455.0, False)])
@pytest.mark.parametrize("correlation", [0.0, 0.6])
def test_twins_are_more_probable_than_not(sd, are_twins, correlation):
    """Kinds are twins if the SD of their difference is below 300 / 0.6745 = 444.8: P(|difference| < 300) > 1/2."""
    variance = sd**2 / (2.0 * (1.0 - correlation))
    covariance = variance * np.array([[1, correlation], [correlation, 1]])
    assert find_twins(believe(build((0, 0)), [5000.0, 5000.0], covariance))[2].tolist() == [are_twins]


def test_selected_colours_are_renumbered_with_their_kinds_and_things():
    covariance = [[9e4, 3e4, 2e4], [3e4, 4e4, 1e4], [2e4, 1e4, 16e4]]
    state = populate(believe(build((0, 2, 1)), [5000.0, 900.0, 3000.0], covariance), [0, 1, 2])
    chosen = select_colours(state, [1, 2], [1, 2])
    assert chosen["kind_colour"].tolist() == [[1, 0]]  # colour 2 is now 1, and its kind still the first
    assert chosen["thing_kind"][0, :, 0].tolist() == [0, 1]
    np.testing.assert_allclose(believe_kinds(chosen).mean, [[900.0, 3000.0]])
    np.testing.assert_allclose(believe_kinds(chosen).covariance, [[[4e4, 1e4], [1e4, 16e4]]])
