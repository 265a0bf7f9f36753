"""Inner simulation and the choice among options."""

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import norm

from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.motion_cost import Costs
from affordance.choice.observed_options import list_options
from affordance.choice.ranking import NO_OPTION, Choice, pick_cheapest, rank
from affordance.choice.reach import Reach
from affordance.control.timed_path import TimedPath, load_path
from affordance.exceptions import AffordanceError
from affordance.files.model_folder import MODELS
from affordance.objects.inertia import Ellipsoid
from affordance.objects.load import load_materials, load_tools
from affordance.objects.tool import find_free_end
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.rollout import measure_costs, roll_out
from affordance.vision.features import VisionError
from affordance.vision.pixels.pipeline import COLOUR_SD
from affordance.vision.visual_prior import predict_object

STICK, HAMMER = load_tools(MODELS / "tools" / "novel.yaml", load_materials(MODELS / "materials.yaml"))
LOOKS = tuple(part.looks_like.colour for part in STICK.components)
REACH = Reach(load_path(MODELS / "paths" / "reach.yaml"))


@pytest.fixture(scope="module")
def choice():
    return Choice(list_options(STICK), REACH)


def believe(wood, steel, sd):
    """A memory of both materials."""
    return MaterialMemory(LOOKS, DensityBelief.from_moments(np.array([wood, steel], float), sd**2 * np.eye(2)))


def compute_work(choice, wood, steel):
    return choice.compute_costs(choice.compute_parameters(believe(1.0, 1.0, 1.0), np.array([[wood, steel]]))).work[
        :, 0
    ]


def test_options_are_the_grips_as_seen():
    options = list_options(STICK)
    assert [option.name for option in options] == ["stick by wood", "stick by steel"]
    for option in options:
        np.testing.assert_allclose(find_free_end(option.gripped), [0.3, 0, 0], atol=1e-12)
    assert options[0].features is options[1].features  # it is looked at once
    (whole,) = list_options(dataclasses.replace(STICK, grips=()))
    assert whole.name == "stick"


def test_object_of_one_density_costs_the_same_in_both_grips(choice):
    """Turned around it is the same object."""
    works = compute_work(choice, 3000.0, 3000.0)
    assert works[0] == pytest.approx(works[1], rel=1e-9)


@pytest.mark.parametrize("ratio", [1.02, 3.0, 11.0])
def test_heavier_end_belongs_into_the_hand(choice, ratio):
    by_wood, by_steel = compute_work(choice, 700.0, 700.0 * ratio)
    assert by_steel < by_wood
    by_wood, by_steel = compute_work(choice, 700.0 * ratio, 700.0)
    assert by_wood < by_steel


def test_exchanging_the_materials_exchanges_the_grips(choice):
    np.testing.assert_allclose(
        compute_work(choice, 900.0, 5000.0), compute_work(choice, 5000.0, 900.0)[::-1], rtol=1e-9
    )


def test_samples_are_those_of_the_belief(choice):
    """Masses of the sampled objects: their mean and spread follow from volumes and densities."""
    memory = believe(2000.0, 6000.0, 300.0)
    pi = choice.draw_parameters(memory, np.random.default_rng(0), 40_000)
    volume = STICK.components[0].shape.volume
    sd = volume * np.sqrt(2 * (300.0**2 + DEFAULT_SETTINGS.prior.deviation_sd**2))
    masses = pi[0, :, 0]
    assert masses.mean() == pytest.approx(volume * 8000.0, abs=5 * sd / np.sqrt(40_000))
    assert masses.std() == pytest.approx(sd, rel=0.02)
    # One object, whichever end is in the hand.
    np.testing.assert_allclose(pi[1, :, 0], masses, rtol=1e-12)
    np.testing.assert_allclose(pi[0, :, 1] + pi[1, :, 1], 0.3 * masses, rtol=1e-9)


def test_different_objects_of_one_material_differ_by_their_own_deviations():
    options = [list_options(dataclasses.replace(STICK, name=name, grips=()))[0] for name in ("one", "other")]
    choice = Choice(options, REACH)
    pi = choice.draw_parameters(believe(2000.0, 6000.0, 300.0), np.random.default_rng(0), 40_000)
    s = DEFAULT_SETTINGS.prior.deviation_sd
    correlation = np.corrcoef(pi[:, :, 0])[0, 1]
    assert correlation == pytest.approx(300.0**2 / (300.0**2 + s**2), abs=0.01)


def test_ranking_is_what_the_samples_say(choice):
    memory = believe(720.0, 1200.0, 300.0)
    ranking = choice.rank(memory, np.random.default_rng(4), 5_000)
    pi = choice.draw_parameters(memory, np.random.default_rng(4), 5_000)
    works = np.array(
        [cost_model.compute(parameters).work for cost_model, parameters in zip(choice.cost_models, pi, strict=True)]
    )
    assert ranking.best.option.grip == "steel"
    best, other = ranking.ranked
    assert best.work == pytest.approx(works[1].mean(), rel=1e-12)
    assert other.work == pytest.approx(works[0].mean(), rel=1e-12)
    assert best.p_best == pytest.approx((works[1] < works[0]).mean(), abs=1e-12)
    assert 0.55 < best.p_best < 0.95
    assert best.p_best + other.p_best + ranking.p_none == pytest.approx(1.0)
    np.testing.assert_array_equal(best.works, works[1])


def test_without_experience_the_plain_object_is_a_matter_of_chance_and_the_headed_one_is_not():
    plain = rank(list_options(STICK), REACH, MaterialMemory())
    p_wood = next(entry.p_best for entry in plain.ranked if entry.option.grip == "wood")
    assert p_wood == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(10_000))
    headed = rank(list_options(HAMMER), REACH, MaterialMemory())
    assert headed.best.option.name == "hammer by steel"
    assert headed.best.p_best > 0.7


def test_different_tools_can_be_options():
    options = [*list_options(STICK), *list_options(HAMMER)]
    ranking = rank(options, REACH, believe(720.0, 7850.0, 50.0), num_samples=1_000)
    assert {entry.option.object_name for entry in ranking.ranked} == {"stick", "hammer"}
    cost_model = [entry.work for entry in ranking.ranked]
    assert cost_model == sorted(cost_model)
    assert sum(entry.p_best for entry in ranking.ranked) == pytest.approx(1.0)


def test_seed_decides_the_samples():
    first, again = (rank(list_options(STICK), REACH, MaterialMemory(), num_samples=200, seed=1) for _ in range(2))
    other = rank(list_options(STICK), REACH, MaterialMemory(), num_samples=200, seed=2)
    np.testing.assert_array_equal(first.best.works, again.best.works)
    assert not np.array_equal(np.sort(first.best.works), np.sort(other.best.works))


def test_option_that_breaks_a_limit_is_never_chosen(choice):
    """Held by the light end this one loads the wrist beyond its limit; held by the heavy one it does not."""
    ranking = choice.rank(believe(500.0, 24_500.0, 100.0), np.random.default_rng(0), 500)
    best, other = ranking.ranked
    assert best.option.grip == "steel"
    assert best.p_feasible > 0.9
    assert other.p_feasible < 0.1
    assert other.p_best < 0.1
    assert ranking.num_usable == 1


def test_if_all_options_break_limits_it_is_said(choice):
    ranking = choice.rank(believe(24_000.0, 24_000.0, 100.0), np.random.default_rng(0), 500)
    assert ranking.num_usable == 0
    assert ranking.p_none == 1.0
    with pytest.raises(
        AffordanceError, match=r"no option can be used: stick by \w+ breaks a torque limit as believed; stick"
    ):
        _ = ranking.best


def test_path_that_cannot_be_followed_makes_no_option_usable():
    outward = Reach(TimedPath(((0.3, 0.0, 0.0),), duration=2.0, tolerance=0.02))
    ranking = rank(list_options(STICK), outward, MaterialMemory(), num_samples=50)
    assert ranking.num_usable == 0
    assert all(entry.p_feasible == 0.0 for entry in ranking.ranked)
    with pytest.raises(AffordanceError, match=r"stick by \w+ leaves the path by 0\.\d+ m, must stay within 0.02 m"):
        _ = ranking.best


def test_option_that_is_not_usable_does_not_change_the_order_of_the_others():
    """An anvil that hardly any sampled density lets be moved: where it could be, everything would be light."""
    part = dataclasses.replace(STICK.components[1], shape=Ellipsoid((0.075, 0.03, 0.03)))
    anvil = dataclasses.replace(STICK, name="anvil", grips=(), components=(STICK.components[0], part))
    memory = believe(6000.0, 10_000.0, 3000.0)
    without = rank(list_options(STICK), REACH, memory, num_samples=3000)
    among = rank([*list_options(STICK), *list_options(anvil)], REACH, memory, num_samples=3000)
    assert among.num_usable == 2
    assert among.ranked[2].option.name == "anvil"
    assert among.ranked[2].p_feasible < 0.5
    assert [entry.option.name for entry in among.ranked[:2]] == [entry.option.name for entry in without.ranked]
    for ours, alone in zip(among.ranked, without.ranked, strict=False):
        assert ours.work == pytest.approx(alone.work, rel=0.02)


def test_equal_options_are_ranked_by_lot(choice):
    """An object of one density, turned around, is the same object."""
    uniform = dataclasses.replace(
        STICK, components=tuple(dataclasses.replace(part, looks_like=part.material) for part in STICK.components)
    ).with_densities(dict.fromkeys(LOOKS, 800.0))
    one_look = tuple(
        dataclasses.replace(part, looks_like=STICK.components[0].looks_like) for part in uniform.components
    )
    alike = Choice(list_options(dataclasses.replace(uniform, components=one_look)), REACH)
    best = [alike.rank(MaterialMemory(), np.random.default_rng(seed), 20).best.option.grip for seed in range(40)]
    assert 8 < best.count("wood") < 32


def test_error_of_seeing_is_that_of_one_look():
    """In either grip it is the same misjudged object: masses agree, and first moments mirror each other."""
    options = list_options(STICK, VisionError(size=0.05, position=0.01), seed=3)
    choice = Choice(options, REACH)
    pi = choice.draw_parameters(believe(720.0, 7850.0, 1.0), np.random.default_rng(0), 200)
    assert pi[0, :, 0].std() > 0.01
    np.testing.assert_allclose(pi[1, :, 0], pi[0, :, 0], rtol=1e-12)
    np.testing.assert_allclose(pi[0, :, 1] + pi[1, :, 1], 0.3 * pi[0, :, 0], rtol=1e-9)


@pytest.mark.parametrize("num_samples", [0, -1])
def test_number_of_samples_must_be_positive(choice, num_samples):
    with pytest.raises(ValueError, match=rf"num_samples is {num_samples}, must be at least 1"):
        choice.rank(MaterialMemory(), np.random.default_rng(0), num_samples)


@pytest.mark.parametrize("count", [0, 2])
def test_options_need_names_of_their_own(count):
    option = list_options(STICK)[0]
    with pytest.raises(AffordanceError, match=r"must be at least one and each of another name"):
        Choice([option] * count, REACH)


@dataclasses.dataclass(frozen=True)
class MadeUpEnergies:
    """Costs that depend on the tool's mass alone, or not even on that."""

    work: Callable
    effort: Callable
    feasible: Callable = lambda mass: mass > 0.0
    infeasible_reason: str = ""

    def compute(self, pi):
        mass = pi[:, 0]
        return Costs(self.work(mass), self.effort(mass), self.feasible(mass))


class MadeUpTask:
    """Hands out the energies of the options in turn."""

    def __init__(self, *cost_model):
        self._energies = iter(cost_model)

    def build_cost(self, model, parts, settings):
        return next(self._energies)


def constant(value):
    return lambda mass: np.full(len(mass), value)


# What two parts of 8000 kg/m^3 together weigh, and a bit more: lighter than that is 100 / sqrt(2 (300^2 + 100^2))
# standard deviations above the middle of the belief below.
MASS = STICK.components[0].shape.volume * 8000.0
LIGHT_MAX = STICK.components[0].shape.volume * 8100.0
P_LIGHT = norm.cdf(100.0 / np.sqrt(2 * (300.0**2 + 100.0**2)))


def rank_made_up(wood, steel, memory=None, num_samples=2_000):
    """Ranks the stick's two grips, by wood and by steel, by made-up energies; returns them in this order too."""
    choice = Choice(list_options(STICK), MadeUpTask(wood, steel), DEFAULT_SETTINGS)
    memory = memory or believe(2000.0, 6000.0, 300.0)
    ranking = choice.rank(memory, np.random.default_rng(0), num_samples)
    return ranking, *sorted(ranking.ranked, key=lambda entry: entry.option.grip == "steel")


def is_light(mass):
    return mass <= LIGHT_MAX


def test_options_are_compared_where_all_usable_ones_are_feasible():
    """By steel all can be done, at 101 J if it is heavy; by wood only what is light can be, and that costs more."""
    ranking, wood, steel = rank_made_up(
        MadeUpEnergies(constant(2.0), constant(30.0), is_light),
        MadeUpEnergies(
            lambda mass: np.where(is_light(mass), 1.0, 101.0), lambda mass: np.where(is_light(mass), 20, 900)
        ),
    )
    assert (ranking.num_usable, ranking.best.option.grip) == (2, "steel")
    assert (wood.work, steel.work) == (2.0, 1.0)
    assert (wood.effort, steel.effort) == (30.0, 20.0)
    assert not ranking.flips
    assert (wood.p_best, steel.p_best, ranking.p_none) == (0.0, 1.0, 0.0)
    assert steel.p_feasible == 1.0
    assert wood.p_feasible == pytest.approx(P_LIGHT, abs=4 * 0.5 / np.sqrt(2_000))
    np.testing.assert_array_equal(wood.works, np.where(steel.works == 1.0, 2.0, np.inf))
    assert (steel.works == 1.0).mean() == wood.p_feasible


@pytest.mark.parametrize(
    ("feasible", "infeasible_reason", "message"),
    [
        (lambda mass: mass < 0.9 * MASS, "", "breaks a torque limit as believed"),
        (lambda mass: mass < 0.0, "leaves the path", "leaves the path"),
    ],
)
def test_option_that_is_not_usable_takes_no_part_in_the_comparison(feasible, infeasible_reason, message):
    """However little it costs. The other's energy is then its mean over all samples."""
    ranking, wood, steel = rank_made_up(
        MadeUpEnergies(constant(0.5), constant(0.5), feasible, infeasible_reason),
        MadeUpEnergies(
            lambda mass: np.where(is_light(mass), 1.0, 101.0), lambda mass: np.where(is_light(mass), 20, 900)
        ),
    )
    assert [entry.option.grip for entry in ranking.ranked] == ["steel", "wood"]
    assert (ranking.num_usable, wood.infeasible_reason, steel.infeasible_reason) == (1, message, "")
    share = (steel.works == 1.0).mean()
    assert steel.work == pytest.approx(101.0 - 100.0 * share, rel=1e-12)
    assert steel.effort == pytest.approx(900.0 - 880.0 * share, rel=1e-12)
    assert not ranking.flips


@pytest.mark.parametrize(("efforts", "flips"), [((10.0, 20.0), False), ((20.0, 10.0), True)])
def test_choice_flips_where_the_least_work_is_not_the_least_effort(efforts, flips):
    for works, grip in (((1.0, 2.0), "wood"), ((2.0, 1.0), "steel")):
        ranking, wood, steel = rank_made_up(
            *(MadeUpEnergies(constant(work), constant(effort)) for work, effort in zip(works, efforts, strict=True)),
        )
        assert ranking.best.option.grip == grip
        assert (wood.work, steel.work) == works
        assert (wood.effort, steel.effort) == efforts
        assert ranking.flips == (flips if grip == "wood" else not flips)


def test_where_no_sample_makes_all_feasible_the_most_probably_feasible_comes_first():
    """Without experience most objects are heavier than the most probable one, which alone both can move."""
    mode = STICK.components[0].shape.volume * 2 * DEFAULT_SETTINGS.prior.mode
    ranking, wood, steel = rank_made_up(
        MadeUpEnergies(constant(1.0), constant(1.0), lambda mass: mass <= mode * (1.0 + 1e-9)),
        MadeUpEnergies(constant(2.0), constant(2.0), lambda mass: mass >= mode * (1.0 - 1e-9)),
        MaterialMemory(),
    )
    assert [entry.option.grip for entry in ranking.ranked] == ["steel", "wood"]
    assert ranking.num_usable == 2
    assert (wood.work, steel.work) == (np.inf, np.inf)
    assert wood.p_feasible < 0.5 < steel.p_feasible
    assert wood.p_best + steel.p_best == 1.0


def test_where_no_option_is_feasible_none_is_the_best():
    ranking, wood, steel = rank_made_up(
        MadeUpEnergies(constant(1.0), constant(1.0), is_light),
        MadeUpEnergies(constant(2.0), constant(2.0), is_light),
    )
    assert wood.p_best == wood.p_feasible == steel.p_feasible
    assert steel.p_best == 0.0
    assert wood.p_best + ranking.p_none == pytest.approx(1.0, abs=1e-12)
    assert ranking.p_none == pytest.approx(1.0 - P_LIGHT, abs=4 * 0.5 / np.sqrt(2_000))


def make_costs(work, feasible):
    return Costs(np.array(work), np.array(work), np.array(feasible))


def test_cheapest_feasible_option_is_picked():
    costs = make_costs([[1.0, 5.0, 2.0, 9.0], [2.0, 3.0, 1.0, 1.0]], [[1, 1, 1, 0], [1, 1, 0, 0]])
    costs = costs._replace(feasible=costs.feasible.astype(bool))
    np.testing.assert_array_equal(pick_cheapest(costs, np.random.default_rng(0)), [0, 1, 0, NO_OPTION])


def test_ties_are_broken_by_a_fair_coin():
    work = np.full((2, 20_000), 3.0)
    work[1] *= 1.0 + 1e-14
    costs = Costs(work, work, np.ones(work.shape, dtype=bool))
    share = pick_cheapest(costs, np.random.default_rng(0)).mean()
    assert share == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(20_000))


def test_simulated_motions_cost_what_inner_simulation_says(choice):
    """The full check, over 100 densities, is in benchmarks/decision.py."""
    rho = np.vstack(
        [[720.0, 7850.0], believe(3000.0, 3000.0, 1500.0).belief.draw_samples(np.random.default_rng(5), 2)]
    )
    costs = choice.compute_costs(choice.compute_parameters(believe(1.0, 1.0, 1.0), rho))
    for k, (wood, steel) in enumerate(rho):
        densities = dict(zip(LOOKS, (wood, steel), strict=True))
        done = [roll_out(STICK.gripped_by(grip), REACH, densities, DEFAULT_SETTINGS) for grip in STICK.grips]
        for rollout, planned in zip(done, costs.work[:, k], strict=True):
            assert rollout.error < REACH.path.tolerance
            assert rollout.work == pytest.approx(planned, rel=0.02)
        assert np.argmin([rollout.work for rollout in done]) == np.argmin(costs.work[:, k])


def test_work_of_a_record_is_the_gain_of_energy_where_nothing_is_braked(choice):
    """Tau v integrated without the magnitude is the change of kinetic and potential energy."""
    rollout = roll_out(
        STICK.gripped_by(STICK.grips[0]), REACH, dict(zip(LOOKS, (720.0, 7850.0), strict=True)), DEFAULT_SETTINGS
    )
    record, control_period = rollout.record, DEFAULT_SETTINGS.control_period
    signed = record._replace(tau=np.sign(record.v) * record.tau)
    rates = 0.5 * (record.v[1:] + record.v[:-1])
    assert measure_costs(record, control_period)[0] >= abs(control_period * np.sum(record.tau[1:] * rates))
    assert measure_costs(signed, control_period) == pytest.approx(measure_costs(record, control_period))
    assert rollout.work == pytest.approx(control_period * np.sum(np.abs(record.tau[1:] * rates)), rel=1e-3)


def recolour(options, *colours):
    """The options with parts of measured colours."""
    features = tuple(
        dataclasses.replace(part, colour=colour, colour_sd=COLOUR_SD)
        for part, colour in zip(options[0].features, colours, strict=True)
    )
    return tuple(dataclasses.replace(option, features=features) for option in options)


def shift(colour, steps):
    return tuple(channel + steps / 255 for channel in colour)


WOOD, STEEL = LOOKS


@pytest.mark.parametrize(
    ("memory", "colours"),
    [
        pytest.param(
            MaterialMemory.from_densities({WOOD: 700.0, shift(WOOD, 6): 1200.0}),
            (shift(WOOD, 3), STEEL),
            id="between",
        ),
        pytest.param(MaterialMemory(), (STEEL, shift(STEEL, 6)), id="novice"),
        pytest.param(MaterialMemory.from_densities({WOOD: 700.0, STEEL: 7850.0}), (WOOD, shift(STEEL, 6)), id="off"),
    ],
)
def test_colours_that_may_be_of_several_materials_are_ranked(memory, colours):
    options = recolour(list_options(STICK), *colours)
    choice = Choice(options, REACH)
    met = choice.add_colours(memory)
    assert met.colours[: len(memory.colours)] == memory.colours
    assert sum(entry.p_best for entry in choice.rank(memory, np.random.default_rng(0), 200).ranked) == pytest.approx(
        1
    )
    belief = predict_object(options[0].features, memory, DEFAULT_SETTINGS.prior)
    assert met.colours == belief.memory.colours
    rho = belief.densities.compute_mode()[None]
    np.testing.assert_allclose(
        choice.compute_parameters(memory, rho)[:, 0, 0], belief.compute_parameters(rho)[0, 0], rtol=1e-12
    )


def test_density_of_an_ambiguous_look_is_expected_from_those_given():
    """Of two woods 3/255 to either side it is the mean, whatever they weigh."""
    options = recolour(list_options(STICK), shift(WOOD, 3), STEEL)
    memory = believe(700.0, 7850.0, 50.0)
    memory = MaterialMemory((WOOD, STEEL), memory.belief).add_colours([shift(WOOD, 6)], DEFAULT_SETTINGS.prior)
    choice = Choice(options, REACH)
    (mass,) = choice.compute_parameters(memory, np.array([[600.0, 7850.0, 1000.0]]))[0, :, 0]
    volume = STICK.components[0].shape.volume
    assert mass == pytest.approx(volume * (7850.0 + 800.0), rel=0.01)


def test_steel_measured_beside_its_colour_is_steel():
    """What was measured beside a known colour gets that one's density, no longer the broad prior."""
    options = recolour(list_options(STICK), WOOD, shift(STEEL, 3))
    choice = Choice(options, REACH)
    memory = MaterialMemory.from_densities({WOOD: 700.0, STEEL: 7850.0})
    assert choice.add_colours(memory) is memory
    assert choice.rank(memory, np.random.default_rng(0), 200).best.option.grip == "steel"


def test_two_things_of_ambiguous_colours_share_one_order_of_materials():
    memory = MaterialMemory.from_densities({WOOD: 700.0, shift(WOOD, 6): 1200.0})
    options = [
        *recolour(list_options(STICK), shift(WOOD, 3), STEEL),
        *recolour(list_options(HAMMER), shift(WOOD, 2), shift(STEEL, 6)),
    ]
    ranking = rank(options, REACH, memory, num_samples=100)
    assert len(ranking.ranked) == 4
