"""What is expected of a thing: the belief for one material, brute force for two, nothing of the truth."""

import dataclasses
from dataclasses import replace

import numpy as np
import pytest
from helpers.refusals import refuse

from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.exceptions import BadArgumentError
from affordance.extensions.advice.expected_inertia import expect
from affordance.extensions.people.experiments.lifts import cylinder
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.objects.tool import Weighing
from affordance.settings import DEFAULT_SETTINGS
from affordance.vision.eye import measure_drawing, measure_features
from affordance.vision.features import VisionError
from affordance.vision.prediction import measure_geometry

CAN = cylinder("can", radius=0.04, height=0.1, mass=0.5)
(STICK, *_) = load_tools(MODELS / "tools" / "novel.yaml")


def look(tool):
    return measure_features(tool, VisionError(), np.random.default_rng(0))


def test_mass_of_one_material_is_its_density_times_the_volume():
    """Both ends of the interval are percentiles of the belief, to the error of even samples."""
    memory = MaterialMemory()
    expected = expect(CAN, memory, features=look(CAN))
    belief = memory.recall([part.appearance for part in look(CAN)], Prior()).densities
    volume = CAN.components[0].shape.volume
    low, high = belief.compute_percentiles([0.05, 0.95])[:, 0] * volume
    assert expected.whole.mass.p05 == pytest.approx(low, rel=5e-3)
    assert expected.whole.mass.p95 == pytest.approx(high, rel=5e-3)
    assert expected.whole.mass.mean == pytest.approx(belief.compute_mean()[0] * volume, rel=5e-3)
    assert expected.parts[0].mass == expected.whole.mass
    assert [each.mean for each in expected.whole.com] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    ratio = expected.whole.inertia[0].p95 / expected.whole.mass.p95
    assert ratio == pytest.approx((3 * 0.04**2 + 0.1**2) / 12.0, rel=1e-9)  # of a cylinder, across its axis


def test_known_materials_leave_the_scatter_of_objects_and_of_drawings():
    parts = STICK.components
    memory = MaterialMemory.from_densities({part.looks_like: part.material.density for part in parts})
    settings = dataclasses.replace(DEFAULT_SETTINGS, prior=Prior(deviation=0.0))
    known = expect(STICK, memory, settings, look(STICK)).whole
    np.testing.assert_allclose([each.mean for each in known.com], STICK.p_TTcm, atol=1e-6)
    assert known.mass.mean == pytest.approx(STICK.mass, rel=1e-4)
    assert known.mass.p95 - known.mass.p05 < 1e-3 * STICK.mass
    drawn = expect(STICK, memory, settings).whole
    assert 1e-3 * STICK.mass < drawn.mass.p95 - drawn.mass.p05 < 0.03 * STICK.mass


def test_parts_of_two_materials_are_those_of_brute_force():
    """Means and intervals of the centre of mass are those of 200,000 independent samples, to their errors."""
    features, memory = look(STICK), MaterialMemory()
    recalled = memory.recall([part.appearance for part in features], Prior())
    rho = recalled.densities.draw_samples(np.random.default_rng(7), 200_000)[:, list(recalled.columns)]
    volumes = np.array([part.shape.volume for part in STICK.components])
    x = np.array([part.X_TE[0, 3] for part in STICK.components])
    masses = rho * volumes
    centre = masses @ x / masses.sum(axis=1)
    about = (masses * (0.2 * (0.015**2 + 0.075**2) + (x - centre[:, None]) ** 2)).sum(axis=1)  # of ellipsoids
    expected = expect(STICK, memory, features=features)
    for found, samples in ((expected.whole.com[0], centre), (expected.whole.inertia[2], about)):
        assert found.mean == pytest.approx(samples.mean(), rel=0.01)
        assert [found.p05, found.p95] == pytest.approx(np.quantile(samples, [0.05, 0.95]), rel=0.03)
    assert [part.name for part in expected.parts] == ["beech", "steel"]
    assert sum(part.mass.mean for part in expected.parts) == pytest.approx(expected.whole.mass.mean, rel=1e-9)
    assert all(part.com[0].p95 - part.com[0].p05 < 1e-12 for part in expected.parts)


def test_weighed_thing_has_the_moments_of_samples_weighted_by_the_weighing():
    """Importance sampling of densities and drawing errors, whose product is in the mass, gives the same moments."""
    sd = 0.01
    memory, heavy = MaterialMemory(), replace(CAN, weighings=(Weighing((), 1.5, sd),))
    found = expect(heavy, memory).whole
    seen = measure_drawing(CAN)
    rng = np.random.default_rng(3)
    densities = memory.recall([part.appearance for part in seen], Prior()).densities
    rho = densities.draw_samples(rng, 1_000_000)
    geometry = measure_geometry(seen, [0], 1)
    pi = geometry.compute_parameters(rho, rng.standard_normal((len(rho), len(geometry.Phi_errors))))
    weights = np.exp(-0.5 * ((pi[:, 0] - 1.5) / sd) ** 2)
    chosen = rng.choice(len(pi), 20_000, p=weights / weights.sum())
    low, high = np.quantile(pi[chosen, 0], [0.05, 0.95])
    assert found.mass.mean == pytest.approx(np.average(pi[:, 0], weights=weights), abs=0.001)
    assert found.mass.p95 - found.mass.p05 == pytest.approx(high - low, rel=0.05)
    assert found.inertia[0].mean == pytest.approx(np.average(pi[:, 4], weights=weights), rel=0.01)


def test_uncertain_form_widens_intervals_and_leaves_no_negative_mass():
    (part,) = CAN.components
    known = MaterialMemory.from_densities({part.looks_like.colour: 1000.0})
    exact = expect(CAN, known).whole
    seen = expect(replace(CAN, components=(replace(part, volume_sd=0.5, place_sd=0.01),)), known).whole
    assert exact.mass.p95 - exact.mass.p05 < 0.25 * exact.mass.mean  # 6 % from object to object
    assert seen.mass.mean == pytest.approx(exact.mass.mean, rel=0.02)
    # The product of two independent factors, 1 with SDs of 0.5 and 0.06.
    assert seen.mass.p95 - seen.mass.p05 == pytest.approx(2.0 * 1.645 * 0.507 * exact.mass.mean, rel=0.03)
    assert seen.com[0].p95 - seen.com[0].p05 == pytest.approx(2.0 * 1.645 * 0.01, rel=0.25)
    features = measure_drawing(replace(CAN, components=(replace(part, volume_sd=0.6),)))
    geometry = measure_geometry(features, [0], 1)
    errors = np.zeros((41, len(geometry.Phi_errors)))
    errors[:, 0] = np.linspace(-4.0, 4.0, 41)
    pi = geometry.compute_parameters(np.full((41, 1), 1000.0), errors)
    assert (pi[:, [0, 4, 5, 6]] > 0.0).all()
    assert (np.diff(pi[:, 0]) >= -1e-12).all()


def test_weighing_within_the_errors_of_the_form_is_no_surprise():
    (part,) = CAN.components
    known = MaterialMemory.from_densities({part.looks_like.colour: 1000.0})
    heavy = 1.8 * expect(CAN, known).whole.mass.mean
    seen = replace(CAN, components=(replace(part, volume_sd=0.5),), weighings=(Weighing((), heavy, 0.01),))
    found = expect(seen, known)
    assert not found.surprises
    assert expect(replace(CAN, weighings=seen.weighings), known).surprises
    assert found.whole.mass.mean == pytest.approx(heavy, rel=0.01)


def test_truth_is_not_looked_at_and_same_question_has_same_answer():
    heavy = CAN.with_densities({CAN.components[0].looks_like.colour: 9000.0})
    assert expect(heavy, MaterialMemory()) == expect(CAN, MaterialMemory())


@pytest.mark.parametrize("arguments", [(None, MaterialMemory()), (CAN, None), (CAN, MaterialMemory(), {})])
def test_arguments_of_another_kind_are_refused(arguments):
    assert "is of type " in refuse(expect, *arguments, error=BadArgumentError)
