import itertools
from dataclasses import replace

import numpy as np
import pytest
from helpers.kinds_by_brute_force import BruteLift, Known, judge, list_odd_columns
from helpers.reference_holds import feel
from scipy.stats import chisquare, norm

from affordance.belief.density_belief import DensityBelief, Prior, summarise_density
from affordance.belief.holds import Felt
from affordance.belief.kinds import count_things, make_room_for_thing
from affordance.belief.kinds_gate import adopt, weigh
from affordance.belief.kinds_learner import KAPPA, Kinds, Pick
from affordance.belief.learner import Seen
from affordance.belief.learners import KINDS_DRAWN, KINDS_MAP
from affordance.belief.likelihood import Likelihood
from affordance.belief.material_memory import MaterialMemory, start_memory
from affordance.objects.appearance import PartAppearance
from affordance.runs.random_streams import ObserverDraws
from studies import exact_reference as reference

PRIOR = Prior(mode=1000.0, sd=4000.0, deviation=0.06)
RGB = {"brass": (0.8, 0.6, 0.1), "steel": (0.5, 0.5, 0.6)}
# By name: colours, and how long.
OBJECTS = {
    "rod": (("brass",), 0.05),
    "long rod": (("brass",), 0.10),
    "bolt": (("steel",), 0.05),
    "mace": (("brass", "steel"), 0.07),
    "pick": (("steel", "brass"), 0.12),
}
FAMILIAR = list(OBJECTS)
OBJECTS |= {"hollow rod": (("brass",), 0.15), "unseen rod": (("brass",), 0.20)}
KAPPA_TRIED = 0.25


def show(name):
    """Appearance of an object's parts."""
    colours, length = OBJECTS[name]
    return [
        PartAppearance(RGB[colour], (length, 0.02, 0.02), (length * k, 0.0, 0.0)) for k, colour in enumerate(colours)
    ]


def measure(R, y, V):
    """What a measurement y = R rho + e, e ~ N(0, V), tells of an object."""
    weights = np.linalg.inv(V)
    log_scale = np.linalg.slogdet(2.0 * np.pi * V)[1]
    likelihood = Likelihood(R.T @ weights @ R, R.T @ weights @ y, -0.5 * (y @ weights @ y + log_scale))
    return Felt.from_quadratic(likelihood)


def weigh_alone(density, sd=150.0):
    """A measurement of the density of an object of one colour."""
    return measure(np.eye(1), np.array([density]), np.array([[sd**2]]))


def lift(memory, name, felt):
    return memory.recall(show(name), PRIOR).memory.learn(felt, PRIOR.deviation).memory


def start(pick=Pick.MAP, kappa=KAPPA_TRIED, seed=(0,)):
    return start_memory(Kinds(pick, kappa=kappa), seed)


def judge_lift(memory, name, felt, prior=PRIOR):
    """Hypotheses about an object that is lifted: their kinds, verdicts, and a function that adopts one of them."""
    recalled = memory.recall(show(name), prior).memory
    seen = recalled.at_hand.seen
    state = make_room_for_thing(recalled.state, seen)
    verdicts = weigh(state, seen, felt)

    def take(place):
        lesson = adopt(state, seen, verdicts, np.array([place]), felt)
        (number,) = seen.things
        things = (*recalled.things[:number], recalled.at_hand.thing, *recalled.things[number + 1 :])
        return replace(recalled, state=lesson.state, things=things, num_lifts=memory.num_lifts + 1, at_hand=None)

    return [tuple(kinds) for kinds in verdicts.hypotheses.kinds.tolist()], verdicts, take


def count_kinds(memory):
    return int(memory.state["is_kind"].sum())


def list_things(memory):
    """For each thing the kinds of its colours, and the columns that have a density of their own."""
    for number, thing in enumerate(memory.things):
        m = len(thing.colours)
        kinds, is_own = memory.state["thing_kind"][0, number, :m], memory.state["is_own"][0, number]
        yield thing, tuple(kinds.tolist()), tuple(np.flatnonzero(is_own).tolist()), number


def believe(memory, name):
    """Mean density believed of an object of one colour before it is lifted."""
    return memory.recall(show(name), PRIOR).densities.untruncated_mean[0]


def gather_known(memory, names):
    """What a memory believes before it learns from the object that it recalled, by the names of its kinds."""
    means, number, state = memory.group().means, memory.at_hand.number, memory.state
    own = [np.zeros(2), np.zeros((2, 2))]
    if number < len(memory.things):
        own = [state[name][0, number] for name in ("own_mean", "own_covariance")]
    return Known(names, means.mean[0], means.covariance[0], *own)


def draw_lift(rng, name):
    """A measurement of an object whose brass may be odd: twice as heavy as that of the others, or not."""
    colours, _ = OBJECTS[name]
    m = len(colours)
    typical = {"brass": 5000.0, "steel": 3000.0}
    odd = {"long rod": 2.0, "mace": 1.8}.get(name, 1.0)
    rho = np.array([typical[colour] * (odd if colour == "brass" else 1.0) for colour in colours])
    R = rng.normal(size=(m + 1, m)) + np.eye(m + 1, m)
    V = np.diag(rng.uniform(150.0, 600.0, m + 1) ** 2)
    return R, R @ rho + rng.multivariate_normal(np.zeros(m + 1), V), V


@pytest.mark.parametrize("seed", range(6))
def test_every_hypothesis_kind_and_object_is_as_by_brute_force(seed, monkeypatch):
    """Probabilities after each of 14 random lifts agree with all assignments enumerated from the history."""
    monkeypatch.setattr("affordance.belief.kinds_gate._SETTLED", 1e-14)
    rng = np.random.default_rng([seed, 8])
    memory = start(Pick.DRAWN, seed=(seed,))
    lifts, born, start_of, names = [], {}, {}, []  # names: those of the memory's kinds, in its order
    for _ in range(14):
        name = str(rng.choice(FAMILIAR))
        colours = OBJECTS[name][0]
        R, y, V = draw_lift(rng, name)
        hypotheses, verdicts, take = judge_lift(memory, name, measure(R, y, V))
        recalled = memory.recall(show(name), PRIOR).memory
        first_new = count_kinds(recalled)
        unmanned = count_things(recalled.state)[0] == 0
        labels = ["unmanned" if unmanned[kind] else names.pop(0) for kind in range(first_new)]
        expected, starts = judge(
            lifts, name, colours, R, y, V, born, gather_known(recalled, labels), kappa=KAPPA_TRIED
        )
        found = {
            tuple("new" if k >= first_new else labels[k] for k in kinds): i for i, kinds in enumerate(hypotheses)
        }
        assert found.keys() == expected.keys()
        for kinds, place in found.items():
            assert verdicts.probability[place] == pytest.approx(expected[kinds], rel=1e-7, abs=1e-12)

        draw = np.random.default_rng([seed, memory.num_lifts + 1])
        (chosen,) = memory.learner.pick_verdicts(verdicts, 1, draw)
        taken = []
        for column, kind in enumerate(hypotheses[chosen]):
            if kind >= first_new:
                taken.append(f"{len(lifts)}.{column}")
                born[taken[-1]] = len(born)
                start_of[taken[-1]] = starts[next(kinds for kinds, place in found.items() if place == chosen)][column]
            else:
                taken.append(labels[kind])
        learned = lift(memory, name, measure(R, y, V))  # by what it draws itself
        memory = take(chosen)
        for key, array in memory.state.items():
            np.testing.assert_array_equal(learned.state[key], array)
        lifts.append(BruteLift(name, colours, tuple(taken), R, y, V))

        last = {done.name: done for done in lifts}
        for thing, of_kinds, own, _ in list_things(memory):  # a kind is identified by the objects that are of it
            lifted = next(done for done in last.values() if show(done.name) == list(thing.appearance))
            for place, kind in zip(of_kinds, lifted.kinds, strict=True):
                names += [""] * (place + 1 - len(names))
                names[place] = kind
            assert list(own) == list_odd_columns(lifts, lifted.name, born)
        for kind, (mean, sd) in start_of.items():
            if kind in names:
                place = names.index(kind)
                assert memory.state["kind_mean"][0, place] == pytest.approx(mean, rel=1e-7)
                assert memory.state["kind_sd"][0, place] == pytest.approx(sd, rel=1e-7)


def enumerate_paths(memory, lifts):
    """All sequences in which a few lifts can be judged: kinds of all objects at the end, and their probability."""
    if not lifts:
        yield describe(memory), 1.0
        return
    (name, felt), *rest = lifts
    hypotheses, verdicts, take = judge_lift(memory, name, felt)
    for place in range(len(hypotheses)):
        for end, probability in enumerate_paths(take(place), rest):
            yield end, verdicts.probability[place] * probability


def describe(memory):
    """Kinds of every object's colours, and mean densities of the kinds."""
    kinds = tuple(kinds for _, kinds, *_ in list_things(memory))
    return kinds, tuple(memory.group().means.mean[0].round(3).tolist())


def integrate_kind(prior_mean, prior_sd, objects):
    """Mean and SD of a kind's mean density by sums: each object has a mean of measurements, and its SD."""
    mu = np.linspace(5.0, 20_000.0, 4000)
    logs = norm.logpdf(mu, prior_mean, prior_sd)
    for mean, sd in objects:
        logs += norm.logpdf(mean, mu, np.hypot(PRIOR.deviation * mu, sd))
    weights = np.exp(logs - logs.max())
    mean = weights @ mu / weights.sum()
    return mean, np.sqrt(weights @ (mu - mean) ** 2 / weights.sum())


def test_holds_of_an_object_stay_with_the_kind_of_that_lift():
    """Every way in which five lifts of two rods can be judged; what was felt of a thing by kind is one object."""
    felt = [("rod", 5000.0), ("long rod", 5200.0), ("rod", 4600.0), ("long rod", 8500.0), ("long rod", 7900.0)]
    ends = [start()]
    for name, density in felt:
        taken = []
        for memory in ends:
            hypotheses, _, take = judge_lift(memory, name, weigh_alone(density, 300.0))
            taken += [take(place) for place in range(len(hypotheses))]
        ends = taken
    split = 0
    for memory in ends:
        state = memory.state
        # The torque of a weighing is the density over its error.
        specimens: dict[tuple[int, int], list[float]] = {}
        for number, count, tau in zip(
            state["hold_thing"][0], state["hold_count"][0], state["hold_tau"][0, :, 0], strict=True
        ):
            thing, kind = state["specimen_thing"][0, number] - 1, state["specimen_kind"][0, number, 0] - 1
            assert (thing, kind) not in specimens  # equal holds are pooled
            specimens[thing, kind] = [300.0 * tau, 300.0 / np.sqrt(count)]
        assert set(enumerate(state["thing_kind"][0, :, 0])) <= set(specimens)
        split += len(specimens) > 2
        for kind in np.flatnonzero(state["is_kind"][0]):
            mine = [object_ for (_, of_kind), object_ in specimens.items() if of_kind == kind]
            mean, sd = integrate_kind(state["kind_mean"][0, kind], state["kind_sd"][0, kind], mine)
            assert state["mean"][0, kind] == pytest.approx(mean, rel=2e-3)
            assert np.sqrt(state["covariance"][0, kind, kind]) == pytest.approx(sd, rel=0.05)
    assert split > 0
    # Where the long rod became a kind of its own in the fourth lift, its first lift still tells of the other kind.
    apart = [each.state for each in ends if each.state["specimen_thing"].shape[1] == 3]
    kept = [state for state in apart if sorted(state["hold_count"][0]) == [1.0, 2.0, 2.0]]
    assert any(sorted((300.0 * state["hold_tau"][0, :, 0]).round(3)) == [4800.0, 5200.0, 8200.0] for state in kept)


# Densities of objects' parts, and by lift the object and the kinds it is taken to be of; None is a new kind. Kinds 0
# and 1 are the first of brass and of steel. The pick changes a kind, and in the second case returns to it.
MIXED = {"mace": (8000, 700), "pick": (700, 3500), "rod": (8200,), "bolt": (2500,)}
START = ("mace", (None, None))
GIVEN = [
    [START, ("pick", (1, 0)), ("pick", (1, None)), ("rod", (0,)), ("mace", (0, 1)), ("pick", (1, 2))],
    [START, ("bolt", (None,)), ("pick", (2, 0)), ("pick", (1, 0)), ("rod", (0,)), ("pick", (2, 0))],
]


@pytest.mark.parametrize("given", GIVEN)
def test_kinds_of_two_colours_are_the_posterior_given_their_objects(given):
    """Errors grow with torques. By quadrature over mean densities of three kinds: mean to 2 %, SD to 5 %."""
    rods, *_ = reference.build_case([*MIXED.values()], len(given))
    memory, holds, specimens = start(), [], []
    for number, (name, wanted) in enumerate(given):
        hold = rods[[*MIXED].index(name) * len(given) + number]
        hypotheses, _, take = judge_lift(memory, name, feel(hold))
        new = np.max(hypotheses, axis=0)
        memory = take(
            hypotheses.index(tuple(n if kind is None else kind for n, kind in zip(new, wanted, strict=True)))
        )
        (kinds,) = (kinds for thing, kinds, *_ in list_things(memory) if list(thing.appearance) == show(name))
        # What is felt of a thing while it is of the same kinds is one object of the reference.
        if (name, kinds) not in specimens:
            specimens.append((name, kinds))
        holds.append(hold._replace(object=specimens.index((name, kinds))))
    state = memory.state
    assert state["is_kind"].tolist() == [[True] * 3]
    assert (state["specimen_thing"] > 0).sum() == len(specimens)
    priors = tuple(zip(state["kind_mean"][0].tolist(), state["kind_sd"][0].tolist(), strict=True))
    expected = reference.compute_posterior(holds, [kinds for _, kinds in specimens], reference.Model(priors=priors))
    means = DensityBelief.from_moments(state["mean"][0], state["covariance"][0])
    for kind, marginal in expected.mu.items():
        found = summarise_density(means, kind)
        assert found.mean == pytest.approx(marginal.mean, rel=0.02), kind
        assert found.sd == pytest.approx(marginal.sd, rel=0.05), kind


def test_drawn_observers_go_every_way_as_often_as_it_is_probable():
    lifts = [("rod", weigh_alone(5000.0)), ("long rod", weigh_alone(8500.0)), ("long rod", weigh_alone(7600.0))]
    lifts.append(("rod", weigh_alone(5300.0)))
    expected = {}
    for end, probability in enumerate_paths(start(), lifts):
        expected[end] = expected.get(end, 0.0) + probability
    assert sum(expected.values()) == pytest.approx(1.0, abs=1e-12)
    learner = Kinds(Pick.DRAWN, kappa=KAPPA_TRIED)
    state, names = learner.start(None, learner.parameters, PRIOR, 1, 300), list(dict(lifts))
    for number, (name, felt) in enumerate(lifts):
        seen = Seen((0,), np.full(300, names.index(name)))
        everyone = np.zeros(300, dtype=np.intp)
        felt = felt._replace(hold=felt.hold.take(everyone), log_constant=felt.log_constant[everyone])
        felt = felt._replace(log_peak=felt.log_peak[everyone])
        state = learner.learn(state, seen, felt, ObserverDraws([(seed, number) for seed in range(300)])).state
    counts = dict.fromkeys(expected, 0)
    for b in range(300):
        means = state["mean"][b][state["is_kind"][b]]
        counts[tuple((kind,) for kind in state["thing_kind"][b, :, 0].tolist()), tuple(means.round(3).tolist())] += 1
    frequent = [end for end in expected if expected[end] > 0.01]
    assert len(frequent) >= 3
    rest = 1.0 - sum(expected[end] for end in frequent)
    observed = [counts[end] for end in frequent] + [300 - sum(counts[end] for end in frequent)]
    assert chisquare(observed, [300 * p for p in [*(expected[end] for end in frequent), rest]]).pvalue > 1e-3


def test_where_nothing_is_odd_both_learners_believe_the_same(rng):
    """Means and covariances agree to 1e-9 for errors that depend on no belief, if every lift is of a member.

    The densities are below half of the prior's SD, so that kinds start with it: s is 2.
    """
    kinds, materials = start(kappa=0.5), MaterialMemory()
    for name in ["rod", "bolt", "mace", "pick", "long rod", "mace"]:
        colours = OBJECTS[name][0]
        rho = np.array([{"brass": 1500.0, "steel": 900.0}[colour] for colour in colours])
        R = rng.normal(size=(3, len(colours)))
        V = 30.0**2 * np.eye(3)
        felt = measure(R, R @ rho + 30.0 * rng.standard_normal(3), V)
        kinds = lift(kinds, name, felt)
        recollection = materials.recall(show(name), PRIOR)
        materials = recollection.memory.learn(felt, PRIOR.deviation).memory
    assert count_kinds(kinds) == 2
    assert kinds.colours == materials.colours
    np.testing.assert_allclose(kinds.belief.untruncated_mean, materials.belief.untruncated_mean, rtol=1e-9)
    np.testing.assert_allclose(kinds.belief.covariance, materials.belief.covariance, rtol=1e-9)


def teach_family(memory, density=5000.0):
    for name, _ in itertools.product(["rod", "long rod"], range(3)):
        memory = lift(memory, name, weigh_alone(density))
    return memory


def test_a_thing_of_its_own_is_right_the_second_time_and_its_material_stays():
    memory = teach_family(start())
    assert believe(memory, "hollow rod") == pytest.approx(5000.0, rel=0.02)  # never lifted: most populous kind
    before = memory.belief.untruncated_mean[0]
    for _ in range(6):
        memory = lift(memory, "hollow rod", weigh_alone(700.0))
    assert believe(memory, "hollow rod") == pytest.approx(700.0, rel=0.05)
    assert memory.belief.untruncated_mean[0] == pytest.approx(before, abs=1e-6)
    assert believe(memory, "unseen rod") == pytest.approx(before, abs=1e-6)


@pytest.mark.parametrize(("family", "odd"), [(30.0, 700.0), (700.0, 30.0), (8500.0, 720.0), (720.0, 8500.0)])
def test_large_surprise_is_right_at_the_second_lift(family, odd):
    """A density ten times higher or lower, felt to 10 %, is learned at once, and the family's stays the same."""
    memory = start()
    for name, _ in itertools.product(["rod", "long rod"], range(3)):
        memory = lift(memory, name, weigh_alone(family, 0.1 * family))
    before = memory.belief.untruncated_mean[0]
    memory = lift(memory, "hollow rod", weigh_alone(odd, 0.1 * odd))
    assert believe(memory, "hollow rod") == pytest.approx(odd, rel=0.05)
    assert memory.belief.untruncated_mean[0] == pytest.approx(before, rel=1e-9)
    memory = lift(memory, "rod", weigh_alone(odd, 0.1 * odd))  # a member that changes is learned too
    assert believe(memory, "rod") == pytest.approx(odd, rel=0.1)


@pytest.mark.parametrize("pick", Pick)
@pytest.mark.parametrize("scale", [0.2, 5.0, 1000.0])
def test_gate_knows_no_scale_of_densities(scale, pick, monkeypatch):
    """Probabilities and relative means stay the same if all densities are scaled; the first prior is flat."""
    monkeypatch.setattr("affordance.belief.kinds_gate._SETTLED", 1e-14)
    ends = []
    for factor in (1.0, scale):
        prior = Prior(PRIOR.mode, 1e9 * factor, PRIOR.deviation)  # flat: the first prior says nothing
        memory, probabilities = start(pick), []
        for name, density in [("rod", 5000.0), ("long rod", 8300.0), ("rod", 4800.0), ("long rod", 9000.0)] * 3:
            felt = weigh_alone(factor * density, 400.0 * factor)
            probabilities += judge_lift(memory, name, felt, prior)[1].probability.tolist()
            memory = memory.recall(show(name), prior).memory.learn(felt, prior.deviation).memory
        ends.append((probabilities, memory.group().means.mean[0] / factor))
    for one, other in zip(*ends, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-9)
    assert len(ends[0][1]) == 2 or pick is Pick.DRAWN  # a drawn hypothesis may keep one kind


def test_evidence_that_a_member_is_odd_does_not_pile_up():
    """An object a third too heavy stays a member in 12 lifts, ever more surely, and leaves no density of its own."""
    memory = teach_family(start())
    p_new = []
    for _ in range(12):
        p_new.append(judge_lift(memory, "hollow rod", weigh_alone(6300.0))[1].probability[-1])
        memory = lift(memory, "hollow rod", weigh_alone(6300.0))
    assert (np.diff(p_new) < 0.0).all()
    assert count_kinds(memory) == 1
    assert not memory.state["is_own"].any()


def test_colours_with_an_error_are_the_most_probable_ones():
    memory = lift(start(), "rod", weigh_alone(5000.0))
    red, green, blue = RGB["brass"]
    seen = [part._replace(colour=(red, green - 0.03, blue), colour_sd=3.0) for part in show("rod")]
    assert memory.recall(seen, PRIOR).memory.colours == (RGB["brass"],)
    other = [part._replace(colour=(0.1, 0.2, 0.9), colour_sd=3.0) for part in show("rod")]
    assert memory.recall(other, PRIOR).memory.colours == (RGB["brass"], (0.1, 0.2, 0.9))


def test_restricting_keeps_some_colours_and_the_objects_that_show_no_other(rng):
    memory = start()
    for name in ["rod", "mace", "bolt"]:
        R, y, V = draw_lift(rng, name)
        memory = lift(memory, name, measure(R, y, V))
    restricted = memory.restrict_to([RGB["steel"]])
    assert restricted.colours == (RGB["steel"],)
    assert [len(thing.appearance) for thing in restricted.things] == [1]
    steel = memory.colours.index(RGB["steel"])
    np.testing.assert_allclose(restricted.belief.untruncated_mean[0], memory.belief.untruncated_mean[steel])
    assert memory.restrict_to(memory.colours) is memory


def test_colours_added_before_anything_is_felt_have_the_prior():
    memory = start().add_colours([RGB["brass"], RGB["steel"]], PRIOR)
    np.testing.assert_allclose(memory.belief.untruncated_mean, [1000.0, 1000.0])
    memory = lift(memory, "rod", weigh_alone(5000.0))
    assert count_kinds(memory) == 2
    assert believe(memory, "bolt") == pytest.approx(1000.0)


def test_learning_without_recalling_is_an_error():
    with pytest.raises(ValueError, match="no object was recalled since the last lift"):
        start().learn(weigh_alone(1.0), 0.1)


@pytest.mark.parametrize("name", ["kappa", "concentration", "switching", "spread"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_settings_that_make_no_sense_are_errors(name, value):
    with pytest.raises(ValueError, match=f"^Parameters: {name}: is .*, must be (from 1e-09 to 1000000000|finite)"):
        Kinds(**{name: value})


def test_kappa_is_the_one_that_was_fitted_with_the_way_to_pick():
    for learner, pick in ((KINDS_MAP, Pick.MAP), (KINDS_DRAWN, Pick.DRAWN)):
        assert learner == Kinds(pick.value) == Kinds(pick, kappa=KAPPA[pick])
        assert learner.parameters.kappa == KAPPA[pick]
        other = learner.change(kappa=0.4)
        assert (other.pick, other.parameters.kappa, other.usual) == (pick, 0.4, learner)
        assert other != learner


def test_a_thing_of_its_own_is_recalled_as_it_was_left():
    """The density of an odd object and its variance are recalled without the scatter about the kind's mean."""
    memory = teach_family(start())
    for _ in range(3):
        recalled = memory.recall(show("hollow rod"), PRIOR)
        lesson = recalled.memory.learn(weigh_alone(700.0), PRIOR.deviation)
        memory = lesson.memory
    again = memory.recall(show("hollow rod"), PRIOR).densities
    np.testing.assert_allclose(again.untruncated_mean, lesson.densities.untruncated_mean, rtol=1e-12)
    np.testing.assert_allclose(again.covariance, lesson.densities.covariance, rtol=1e-9)


def test_density_of_a_thing_of_its_own_drifts_between_its_lifts():
    """Its variance before a lift is that after the last one and the square of the drift, once however often asked."""
    memory = teach_family(start())
    for _ in range(3):
        recalled = memory.recall(show("hollow rod"), PRIOR)
        memory = recalled.memory.learn(weigh_alone(700.0), PRIOR.deviation).memory
    still = memory.recall(show("hollow rod"), PRIOR).densities
    rod = memory.recall(show("rod"), PRIOR).densities
    drifting = replace(memory, state={**memory.state, "own_drift": np.array([0.07])})
    for _ in range(2):
        recalled = drifting.recall(show("hollow rod"), PRIOR)
        drifting, drifted = recalled.memory, recalled.densities
        np.testing.assert_allclose(drifted.untruncated_mean, still.untruncated_mean, rtol=1e-12)
        added = (0.07 * still.untruncated_mean[0]) ** 2
        np.testing.assert_allclose(drifted.covariance, still.covariance + added, rtol=1e-9)
    np.testing.assert_allclose(drifting.recall(show("rod"), PRIOR).densities.covariance, rod.covariance, rtol=1e-12)


def test_probabilities_of_the_kinds_an_object_may_be_of_sum_to_one(rng):
    """Probabilities of a colour's kinds, each summed over the kinds of the object's other colour, add up to one."""
    memory = start()
    for name in ("rod", "bolt", "long rod", "rod", "bolt"):
        R, y, V = draw_lift(rng, name)
        memory = lift(memory, name, measure(R, y, V))
    hypotheses, _, take = judge_lift(memory, "mace", measure(*draw_lift(rng, "mace")))
    for column in range(2):
        by_kind = {kinds[column]: place for place, kinds in enumerate(hypotheses)}
        probabilities = [take(place).state["probability"][0, -1, column] for place in by_kind.values()]
        assert len(probabilities) > 1
        assert sum(probabilities) == pytest.approx(1.0, rel=1e-9)


def test_belief_about_things_never_lifted_has_one_density_a_colour():
    """A colour has the density of its most populous kind, whichever place that has among the kinds."""
    memory = lift(teach_family(start()), "hollow rod", weigh_alone(700.0))
    memory = lift(memory, "bolt", weigh_alone(3000.0))
    assert count_kinds(memory) == 3
    assert memory.belief.size == len(memory.colours) == 2
    np.testing.assert_allclose(memory.belief.untruncated_mean, [5000.0, 3000.0], rtol=0.02)


def test_brightness_is_as_sure_as_hue_unless_more_is_said():
    memory = lift(start(), "rod", weigh_alone(5000.0))
    darker = tuple(0.87 * channel for channel in RGB["brass"])
    assert (
        memory.recognise(darker, 0.7, PRIOR)[1] == 1
    )  # never met; with an error of 1 in brightness it would be known
    assert memory.recognise(darker, 0.7, PRIOR, 0.0)[1] == 1
    assert memory.recognise(darker, 0.7, PRIOR, 6.0)[1] == 0


def test_the_kind_of_an_object_is_found_by_its_look():
    """Kinds of a colour are numbered from 1, the oldest; without a lift, or without kinds, the number is 0."""
    memory = start()
    for name, density in (("rod", 5000.0), ("long rod", 5000.0), ("hollow rod", 700.0), ("bolt", 3000.0)) * 3:
        memory = lift(memory, name, weigh_alone(density))
    assert [memory.find_kind(show(name)) for name in ("rod", "long rod", "hollow rod", "bolt")] == [1, 1, 2, 1]
    assert memory.find_kind(show("unseen rod")) == 0
    assert lift(MaterialMemory(), "bolt", weigh_alone(3000.0)).find_kind(show("bolt")) == 0
