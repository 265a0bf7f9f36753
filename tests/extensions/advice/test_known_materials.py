"""Materials that are known by name have their handbook density, and what was learned of them is added."""

import numpy as np
import pytest
from helpers.refusals import refuse

from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.likelihood import Likelihood
from affordance.belief.material_memory import MaterialMemory, start_memory
from affordance.exceptions import BadArgumentError
from affordance.extensions.advice.known_materials import know_by_name
from affordance.objects.inertia import Ellipsoid
from affordance.objects.materials import Material
from affordance.objects.tool import Component, Tool

STEEL = Material("steel", (0.5, 0.5, 0.6), 7850.0, 87.0)
OAK = Material("oak", (0.8, 0.6, 0.3), 700.0, 70.0)
INOX = Material("inox", STEEL.colour, 8000.0, 40.0)
PAINT = Material("#ff0000", (1.0, 0.0, 0.0), 7850.0, 87.0)
UNNAMED = Material("#00ff00", (0.0, 1.0, 0.0), 123.0, 10.0)
HANDBOOK = {each.name: each for each in (STEEL, OAK, INOX)}
PRIOR = Prior()


def make(*parts: tuple[Material, Material]) -> list[Tool]:
    shape = Ellipsoid((0.1, 0.1, 0.1))
    return [Tool("thing", tuple(Component(shape, np.eye(4), *part) for part in parts))]


def moments(memory: MaterialMemory, material: Material) -> tuple[float, float]:
    column = memory.colours.index(material.colour)
    return memory.belief.untruncated_mean[column], np.sqrt(memory.belief.covariance[column, column])


def test_named_materials_have_the_handbooks_mean_and_spread() -> None:
    named = know_by_name(MaterialMemory(), make((STEEL, STEEL), (OAK, OAK)), HANDBOOK, PRIOR)
    assert named[1:] == (("steel", "oak"), (), (), 0.06)
    assert moments(named.memory, STEEL) == pytest.approx((7850.0, 87.0))
    assert moments(named.memory, OAK) == pytest.approx((700.0, 70.0))


def test_evidence_of_a_memory_is_added_as_if_the_handbook_had_been_known_before() -> None:
    rng = np.random.default_rng(0)
    A = rng.normal(size=(2, 2))
    evidence = Likelihood(1e-4 * (A @ A.T), np.array([0.8, 0.1]), 0.0)
    broad = DensityBelief.from_moments(np.full(2, PRIOR.mode), PRIOR.sd**2 * np.eye(2))
    memory = MaterialMemory.from_belief((STEEL.colour, OAK.colour), broad.condition(evidence))
    named = know_by_name(memory, make((STEEL, STEEL), (OAK, OAK)), HANDBOOK, PRIOR)
    narrow = DensityBelief.from_moments(np.array([7850.0, 700.0]), np.diag([87.0**2, 70.0**2]))
    expected = narrow.condition(evidence)
    np.testing.assert_allclose(named.memory.belief.precision, expected.precision, rtol=1e-10)
    np.testing.assert_allclose(named.memory.belief.untruncated_mean, expected.untruncated_mean, rtol=1e-10)
    assert named.learned == ("steel", "oak")


@pytest.mark.parametrize(
    ("part", "names", "known", "unknown"),
    [
        ((OAK, STEEL), None, ("steel",), ()),  # it looks like steel
        ((STEEL, PAINT), None, ("steel",), ()),  # painted: the material has the name
        ((UNNAMED, UNNAMED), None, (), ("#00ff00",)),
        ((STEEL, STEEL), [], (), ("steel",)),
        ((STEEL, STEEL), ["oak"], (), ("steel",)),
        ((STEEL, STEEL), ["steel", "oak"], ("steel",), ()),
    ],
)
def test_name_of_the_look_counts_then_that_of_the_material(
    part: tuple[Material, Material], names: list[str] | None, known: tuple[str, ...], unknown: tuple[str, ...]
) -> None:
    named = know_by_name(MaterialMemory(), make(part), HANDBOOK, PRIOR, names)
    assert (named.known, named.unknown) == (known, unknown)
    if known:
        assert named.memory.colours == (part[1].colour,)
        assert named.memory.belief.untruncated_mean == pytest.approx([7850.0])
    else:
        assert named.memory.colours == ()


def test_materials_of_one_colour_are_mixed() -> None:
    named = know_by_name(MaterialMemory(), make((STEEL, STEEL), (INOX, INOX)), HANDBOOK, PRIOR)
    draws = np.concatenate([7850.0 + 87.0 * np.array([-1, 1]), 8000.0 + 40.0 * np.array([-1, 1])])
    assert moments(named.memory, STEEL) == pytest.approx((draws.mean(), draws.std()))


def test_memory_of_kinds_is_left_as_it_is() -> None:
    memory = start_memory("kinds_map")
    named = know_by_name(memory, make((STEEL, STEEL)), HANDBOOK, PRIOR)
    assert named.memory is memory
    assert named.unknown == ("steel",)


def test_unknown_name_is_refused_with_the_nearest() -> None:
    said = refuse(know_by_name, MaterialMemory(), make((OAK, OAK)), HANDBOOK, PRIOR, ["stel"], error=BadArgumentError)
    assert "is 'stel', must be one of steel, oak, inox; did you mean 'steel'?" in said
