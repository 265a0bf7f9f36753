"""Inner simulation: costs that a task is believed to have with each option."""

import dataclasses

import numpy as np
import pytest
from helpers.two_tools import HAMMER, REACH, STEEL, STICK, WOOD, believe

from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.inner_simulation import plan_choice
from affordance.choice.listed_options import list_options
from affordance.choice.ranking import rank, rank_options
from affordance.exceptions import AffordanceError
from affordance.extensions.pixels.pipeline import COLOUR_SD
from affordance.settings import DEFAULT_SETTINGS
from affordance.simulation.rollout import roll_out
from affordance.vision.features import VisionError
from affordance.vision.prediction import predict_object


@pytest.fixture(scope="module")
def choice():
    return plan_choice(list_options(STICK), REACH)


def compute_work(choice, wood, steel):
    return choice.compute_costs(choice.compute_parameters(believe(1.0, 1.0, 1.0), np.array([[wood, steel]]))).work[
        :, 0
    ]


@pytest.mark.parametrize("ratio", [1.02, 3.0, 11.0])
def test_heavier_end_belongs_into_the_hand(choice, ratio):
    by_wood, by_steel = compute_work(choice, 700.0, 700.0 * ratio)
    assert by_steel < by_wood
    by_wood, by_steel = compute_work(choice, 700.0 * ratio, 700.0)
    assert by_wood < by_steel


@pytest.mark.parametrize(("wood", "steel"), [(900.0, 5000.0), (3000.0, 3000.0)])
def test_exchanging_the_materials_exchanges_the_grips(choice, wood, steel):
    """The stick of one density is the same object turned end for end, and takes the same work."""
    works, exchanged = compute_work(choice, wood, steel), compute_work(choice, steel, wood)
    np.testing.assert_allclose(works, exchanged[::-1], rtol=1e-9)


def test_samples_are_those_of_the_belief(choice):
    """Masses of sampled objects have the mean and SD that follow from volumes and densities."""
    memory = believe(2000.0, 6000.0, 300.0)
    pi = choice.draw_parameters(memory, np.random.default_rng(0), 40_000)
    volume = STICK.components[0].shape.volume
    deviation = DEFAULT_SETTINGS.prior.deviation
    squares = 2000.0**2 + 6000.0**2 + 2 * 300.0**2
    sd = volume * np.sqrt(2 * 300.0**2 + deviation**2 * squares)
    masses = pi[0, :, 0]
    assert masses.mean() == pytest.approx(volume * 8000.0, abs=5 * sd / np.sqrt(40_000))
    assert masses.std() == pytest.approx(sd, rel=0.02)
    # One object, whichever end is in the hand.
    np.testing.assert_allclose(pi[1, :, 0], masses, rtol=1e-12)
    np.testing.assert_allclose(pi[0, :, 1] + pi[1, :, 1], 0.3 * masses, rtol=1e-9)


def test_different_objects_of_one_material_differ_by_their_own_deviations():
    options = [list_options(dataclasses.replace(STICK, name=name, grips=()))[0] for name in ("one", "other")]
    choice = plan_choice(options, REACH)
    pi = choice.draw_parameters(believe(2000.0, 6000.0, 300.0), np.random.default_rng(0), 40_000)
    deviation = DEFAULT_SETTINGS.prior.deviation
    s = deviation * np.sqrt(0.5 * (2000.0**2 + 6000.0**2) + 300.0**2)  # root mean square of both halves
    correlation = np.corrcoef(pi[:, :, 0])[0, 1]
    assert correlation == pytest.approx(300.0**2 / (300.0**2 + s**2), abs=0.01)


def test_error_of_seeing_is_that_of_one_look():
    """Both grips have the errors of the same look: masses agree, and first moments mirror each other."""
    options = list_options(STICK, VisionError(size=0.05, position=0.01), seed=3)
    choice = plan_choice(options, REACH)
    pi = choice.draw_parameters(believe(720.0, 7850.0, 1.0), np.random.default_rng(0), 200)
    assert pi[0, :, 0].std() > 0.01
    np.testing.assert_allclose(pi[1, :, 0], pi[0, :, 0], rtol=1e-12)
    np.testing.assert_allclose(pi[0, :, 1] + pi[1, :, 1], 0.3 * pi[0, :, 0], rtol=1e-9)


@pytest.mark.parametrize("count", [0, 2])
def test_options_need_names_of_their_own(count):
    option = list_options(STICK)[0]
    with pytest.raises(AffordanceError, match=r"must be at least one, with different names"):
        plan_choice([option] * count, REACH)


def test_simulated_motions_cost_what_inner_simulation_says(choice):
    """Works of simulated motions agree to 0.1 % with those of inner simulation, whose torques are those of mid-ticks.

    A check over more beliefs, tools and both tasks is in docs/decisions/0012-reaching.md.
    """
    rho = np.vstack(
        [[720.0, 7850.0], believe(3000.0, 3000.0, 1500.0).belief.draw_samples(np.random.default_rng(5), 2)]
    )
    costs = choice.compute_costs(choice.compute_parameters(believe(1.0, 1.0, 1.0), rho))
    for k, (wood, steel) in enumerate(rho):
        densities = dict(zip((WOOD, STEEL), (wood, steel), strict=True))
        done = [roll_out(STICK.gripped_by(grip), REACH, densities, DEFAULT_SETTINGS) for grip in STICK.grips]
        for rollout, planned in zip(done, costs.work[:, k], strict=True):
            assert rollout.error < REACH.path.tolerance
            assert rollout.work == pytest.approx(planned, rel=1e-3)
        assert np.argmin([rollout.work for rollout in done]) == np.argmin(costs.work[:, k])


def recolour(options, *colours):
    """The options with parts of measured colours."""
    features = tuple(
        dataclasses.replace(part, colour=colour, colour_sd=COLOUR_SD)
        for part, colour in zip(options[0].features, colours, strict=True)
    )
    return tuple(dataclasses.replace(option, features=features) for option in options)


def shift(colour, steps):
    return tuple(channel + steps / 255 for channel in colour)


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
    choice = plan_choice(options, REACH)
    met = choice.add_colours(memory)
    assert met.colours[: len(memory.colours)] == memory.colours
    ranked = rank_options(choice, memory, np.random.default_rng(0), 200).ranked
    assert sum(entry.p_best for entry in ranked) == pytest.approx(1.0)
    belief = predict_object(options[0].features, memory, DEFAULT_SETTINGS.prior)
    assert met.colours == belief.memory.colours
    rho = belief.memory.belief.compute_mode()[None]
    own = rho[:, list(belief.memory.at_hand.thing.colours)]
    np.testing.assert_allclose(
        choice.compute_parameters(memory, rho)[:, 0, 0], belief.compute_parameters(own)[0, 0], rtol=1e-12
    )


def test_density_of_an_ambiguous_look_is_expected_from_those_given():
    """A colour 3/255 from either of two woods has the mean of their given densities, 800 kg/m^3."""
    options = recolour(list_options(STICK), shift(WOOD, 3), STEEL)
    memory = believe(700.0, 7850.0, 50.0)
    memory = MaterialMemory.from_belief((WOOD, STEEL), memory.belief).add_colours(
        [shift(WOOD, 6)], DEFAULT_SETTINGS.prior
    )
    choice = plan_choice(options, REACH)
    (mass,) = choice.compute_parameters(memory, np.array([[600.0, 7850.0, 1000.0]]))[0, :, 0]
    volume = STICK.components[0].shape.volume
    assert mass == pytest.approx(volume * (7850.0 + 800.0), rel=0.01)


def test_steel_measured_beside_its_colour_is_steel():
    """A part 3/255 from the colour of steel takes the density of steel instead of the broad prior."""
    options = recolour(list_options(STICK), WOOD, shift(STEEL, 3))
    choice = plan_choice(options, REACH)
    memory = MaterialMemory.from_densities({WOOD: 700.0, STEEL: 7850.0})
    assert choice.add_colours(memory) is memory
    assert rank_options(choice, memory, np.random.default_rng(0), 200).best.option.grip == "steel"


def test_two_things_of_ambiguous_colours_share_one_order_of_materials():
    memory = MaterialMemory.from_densities({WOOD: 700.0, shift(WOOD, 6): 1200.0})
    options = [
        *recolour(list_options(STICK), shift(WOOD, 3), STEEL),
        *recolour(list_options(HAMMER), shift(WOOD, 2), shift(STEEL, 6)),
    ]
    ranking = rank(options, REACH, memory, num_samples=100)
    assert len(ranking.ranked) == 4


def test_densities_left_out_are_expected_from_those_given():
    """The density that is not given follows from the regression line of two correlated densities."""
    covariance = np.array([[300.0**2, 0.8 * 300.0 * 900.0], [0.8 * 300.0 * 900.0, 900.0**2]])
    memory = MaterialMemory.from_belief(
        (WOOD, STEEL), DensityBelief.from_moments(np.array([700.0, 7850.0]), covariance)
    )
    mass = plan_choice(list_options(STICK), REACH).compute_parameters(memory, np.array([[1000.0]]))[0, 0, 0]
    steel = 7850.0 + 0.8 * 900.0 / 300.0 * (1000.0 - 700.0)
    assert mass == pytest.approx(STICK.components[0].shape.volume * (1000.0 + steel), rel=1e-9)
