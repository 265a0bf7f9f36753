"""Every claim can fail: something that the program simulates, changed in one thing, does not meet it.

Changes are settings by name, objects, a wider or narrower category of kinds, a blow that is planned wrongly,
a detector that is slow or out of scale: no number is made up. Each claim is judged as shipped too, by few observers.
Claims of `make trust` are about the program itself, and are not here.
"""

import functools
from collections.abc import Callable, Mapping
from typing import NamedTuple

import pytest
from helpers import counter_runs as runs
from helpers.counter_runs import NO_SAMPLES, ONE_KIND, OWN_KINDS, Numbers

from affordance.files.model_folder import MODELS
from affordance.protocols.protocol import load_protocol
from affordance.reporting.claims import Claim, judge_claims

partial = functools.partial
type Run = Callable[[], Numbers]


class CounterExamples(NamedTuple):
    """Simulations that contradict the claims of a section."""

    as_shipped: Run  # small run in which nothing is changed
    # Small runs by what is changed in them, each with the keys of the claims that it contradicts.
    changed: Mapping[str, tuple[Run, str]]
    # Keys of claims that even the program as shipped does not meet, with so few observers or at all.
    not_met: str = ""


ALL = {
    "weight": CounterExamples(
        partial(runs.hold, "weight"),
        {
            "no samples": (partial(runs.hold, "weight", NO_SAMPLES), "percentiles flatter decoy_lifted"),
            "denser prior": (runs.believe_denser, "density_estimate drop_reduced first_object"),
        },
    ),
    "com": CounterExamples(
        partial(runs.hold, "com"),
        {"no samples": (partial(runs.hold, "com", NO_SAMPLES), "mass_and_com inertia accurate_stay decoy_lifted")},
        "mass_and_com",  # with two observers the error of the centre of mass is 10.2 mm
    ),
    "linear_plus": CounterExamples(
        partial(runs.lift, 0, repeats=2),
        {
            "nothing is felt": (partial(runs.lift, 0, is_numb=True), "first_lift"),
            "own kinds": (partial(runs.lift, 0, kappa=OWN_KINDS), "fraction"),
        },
    ),
    "linear_plus_plus": CounterExamples(
        partial(runs.lift, 1, repeats=2),
        {"nothing is felt": (partial(runs.lift, 1, is_numb=True), "first_lift fraction")},
    ),
    "two_families": CounterExamples(
        partial(runs.lift_family, "two_families"),
        {"one kind": (partial(runs.lift_family, "two_families", kappa=ONE_KIND), "apart")},
    ),
    "spoilt_family": CounterExamples(
        partial(runs.lift_family, "spoilt_family"),
        {"one kind": (partial(runs.lift_family, "spoilt_family", kappa=ONE_KIND), "apart")},
        "apart",  # with one observer
    ),
    "next_lift": CounterExamples(
        runs.lift_next,
        {
            "nobody doubts what was felt": (
                partial(runs.lift_next, has_no_doubts=True),
                "like_next brass_last three_lifts",
            )
        },
    ),
}


def list_claims_of(name: str) -> dict[str, Claim]:
    """The claims of a protocol."""
    return {claim.key: claim for claim in load_protocol(MODELS / "protocols" / f"{name}.yaml").report.claims}


@pytest.mark.parametrize("name", ALL)
def test_every_claim_is_contradicted_by_a_simulation_and_judged_as_shipped(name):
    contradict(ALL[name], list_claims_of(name))


def contradict(section, claims):
    assert sorted(key for _, keys in section.changed.values() for key in keys.split()) == sorted(claims)
    for run, keys in section.changed.values():
        numbers = run()
        for key in keys.split():
            (found,) = judge_claims([claims[key]], numbers)
            assert not found.met, (key, found)
    for key, shipped in zip(claims, judge_claims([*claims.values()], section.as_shipped()), strict=True):
        assert all(criterion.value not in ("none", "nan") for criterion in shipped.criteria), shipped
        assert shipped.met or key in section.not_met.split(), shipped


def test_every_protocol_with_claims_is_here():
    """Claims of reaching and hammering are contradicted in settings of the study of robustness."""
    names = {path.stem for path in (MODELS / "protocols").glob("*.yaml")} - {"reach", "hammer"}
    assert {name for name in names if list_claims_of(name)} == ALL.keys()
