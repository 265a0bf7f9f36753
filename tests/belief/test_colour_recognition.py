import numpy as np
import pytest
from scipy.stats import multivariate_normal

from affordance.belief.colour_recognition import (
    CERTAIN,
    GAMUT_VOLUME,
    JUST_NOTICEABLE,
    compute_colour_probabilities,
    find_material,
)
from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.learner import describe_prior
from affordance.belief.material_memory import MaterialMemory
from affordance.objects.appearance import PartAppearance
from affordance.objects.colour import convert_to_lab

PRIOR = Prior(mode=1000.0, sd=4000.0, deviation=0.06)
BRASS, STEEL, BEECH = (0.83, 0.63, 0.09), (0.49, 0.54, 0.60), (0.79, 0.56, 0.35)
NEARLY_STEEL = (0.52, 0.54, 0.60)


@pytest.mark.parametrize(("sd", "known"), [(0.7, [STEEL, BRASS]), (0.7, []), (1e-3, [(0.0, 0.0, 0.0)])])
def test_colour_unlike_all_others_was_never_met(sd, known):
    """The last known colour is so far away that its density is zero in double precision."""
    probabilities = compute_colour_probabilities((0.1, 0.8, 0.2), sd, known)
    assert probabilities[-1] > 0.999
    assert probabilities.sum() == pytest.approx(1.0)


def test_volume_of_the_gamut_is_right(rng):
    """The volume is the mean over colours of the determinant of the map to CIELAB, by finite differences, to 5 %."""
    colours = rng.uniform(0.01, 0.99, (20_000, 3))
    step = 5e-3
    columns = [
        (convert_to_lab(colours + step * e) - convert_to_lab(colours - step * e)) / (2 * step) for e in np.eye(3)
    ]
    volume = np.abs(np.linalg.det(np.stack(columns, axis=-1))).mean()
    assert volume == pytest.approx(GAMUT_VOLUME, rel=0.05)


def test_measured_colour_of_a_known_material_is_that_material():
    memory = MaterialMemory.from_densities({BRASS: 8500.0, STEEL: 7850.0})
    again, index = memory.recognise((0.485, 0.545, 0.595), 0.7, PRIOR)
    assert index == 1
    assert again is memory


def test_colour_never_seen_gets_the_broad_prior():
    memory, index = MaterialMemory.from_densities({BRASS: 8500.0}).recognise(STEEL, 0.7, PRIOR)
    assert index == 1
    assert memory.belief.untruncated_mean[1] == pytest.approx(PRIOR.mode, rel=1e-3)
    assert np.sqrt(memory.belief.covariance[1, 1]) == pytest.approx(PRIOR.sd, rel=1e-3)
    first, index = MaterialMemory().recognise(STEEL, 0.7, PRIOR)
    assert index == 0
    assert first.belief.untruncated_mean == pytest.approx([PRIOR.mode])


def test_ambiguous_colour_has_the_moments_of_the_mixture(rng):
    covariance = np.array([[200.0**2, 0.5 * 200 * 300], [0.5 * 200 * 300, 300.0**2]])
    belief = DensityBelief.from_moments(np.array([8000.0, 3000.0]), covariance)
    probabilities = np.array([0.5, 0.3, 0.2])
    memory = MaterialMemory.from_belief((BRASS, STEEL), belief)
    state, index = memory.learner.meet({**memory.state, **describe_prior(PRIOR, 1)}, probabilities)
    assert index == 2
    extended = memory.learner.believe(state)
    known = rng.multivariate_normal(belief.untruncated_mean, covariance, 400_000)
    never = rng.normal(PRIOR.mode, PRIOR.sd, len(known))
    which = rng.choice(3, len(known), p=probabilities)
    mixed = np.choose(which, [known[:, 0], known[:, 1], never])
    drawn = np.column_stack([known, mixed])
    np.testing.assert_allclose(extended.mean[0], drawn.mean(axis=0), atol=20.0)
    scale = np.sqrt(np.diag(np.cov(drawn.T)))
    np.testing.assert_allclose(extended.covariance[0] / np.outer(scale, scale), np.corrcoef(drawn.T), atol=0.01)


def test_what_is_felt_of_an_ambiguous_colour_teaches_both_materials():
    memory = MaterialMemory().add_colours([STEEL, NEARLY_STEEL], PRIOR)
    between = tuple(float(x) for x in 0.5 * (np.array(STEEL) + np.array(NEARLY_STEEL)))
    memory, index = memory.recognise(between, 0.7, PRIOR)
    assert index == 2
    shares = compute_colour_probabilities(between, 0.7, memory.colours[:2])
    assert shares.max() < CERTAIN
    covariance = memory.belief.covariance
    np.testing.assert_allclose(covariance[2, :2] / PRIOR.sd**2, shares[:2], atol=1e-6)


def test_looks_kept_carry_their_beliefs():
    memory = MaterialMemory.from_densities({BRASS: 8500.0, STEEL: 7850.0, BEECH: 720.0})
    assert memory.restrict_to(memory.colours) is memory
    kept = memory.restrict_to([BEECH, BRASS])
    assert kept.colours == (BEECH, BRASS)
    np.testing.assert_allclose(kept.belief.untruncated_mean, [720.0, 8500.0])


def light(colours):
    """Light of colours of sRGB, linear (IEC 61966-2-1)."""
    colours = np.asarray(colours)
    return np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)


def find_lab(light):
    """CIELAB of linear light, white D65 (CIE 15:2004)."""
    xyz = light @ np.array(
        [[0.412453, 0.212671, 0.019334], [0.357580, 0.715160, 0.119193], [0.180423, 0.072169, 0.950227]]
    )
    x, y, z = (
        np.cbrt(t) if t > (6 / 29) ** 3 else t / 3 / (6 / 29) ** 2 + 4 / 29 for t in xyz / (0.950456, 1.0, 1.088754)
    )
    return np.array([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])


@pytest.mark.parametrize("measured", [(0.80, 0.61, 0.10), (0.113, 0.111, 0.112), (0.03, 0.02, 0.02)], ids=str)
@pytest.mark.parametrize("lightness_sd", [0.0, 4.0])
def test_brightness_has_an_error_of_its_own(measured, lightness_sd):
    """Probabilities agree with normal densities in CIELAB whose covariance is longer along changes of brightness."""
    sd = 0.7
    known = [BRASS, tuple(0.9 * np.array(measured)), tuple(1.05 * np.array(measured)), BEECH]
    along = find_lab(1.001 * light(measured)) - find_lab(0.999 * light(measured))
    u = lightness_sd * along / along[0]
    covariance = (sd**2 + JUST_NOTICEABLE**2) * np.eye(3) + np.outer(u, u)
    at = convert_to_lab(np.array(measured))
    weights = [multivariate_normal.pdf(convert_to_lab(np.array(each)), at, covariance) for each in known]
    weights = np.array([*weights, 1.0 / GAMUT_VOLUME])
    found = compute_colour_probabilities(measured, sd, known, lightness_sd)
    # OpenCV rounds a* and b* to a quarter of a unit, which turns the direction of dark colours by a hundredth.
    np.testing.assert_allclose(found, weights / weights.sum(), rtol=0.01, atol=1e-9)


_WOOD, _STEEL, _BRASS = (0.7, 0.5, 0.3), (0.5, 0.5, 0.5), (0.8, 0.6, 0.1)


def test_materials_are_found_by_colour():
    exact = PartAppearance(_WOOD, (0.1,), (0.0, 0.0, 0.0))
    assert find_material(exact, (_STEEL, _WOOD)) == 1
    assert find_material(exact, (_STEEL, _BRASS)) is None
    measured = exact._replace(colour=(0.71, 0.5, 0.29), colour_sd=2.0)
    assert find_material(measured, (_STEEL, _WOOD)) == 1
    assert find_material(measured._replace(colour=(0.1, 0.2, 0.9)), (_STEEL, _WOOD)) is None
