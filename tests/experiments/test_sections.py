"""Every bound of every section is needed: some numbers contradict it and nothing else.

Numbers are in tests/experiments/counterexamples/, a file for each section file and protocol. That a simulation can
give such numbers is tested in test_counter_examples.py.
"""

import itertools
from pathlib import Path

import pytest
import yaml
from helpers.section_files import find_sections

from affordance.files.model_folder import MODELS
from affordance.protocols.protocol import load_protocol
from affordance.reporting.claims import judge_claims
from affordance.reporting.section import load_claims

PROTOCOLS = ("weight", "com", "reach", "hammer", "next_lift")
SECTIONS = find_sections()
FOLDER = Path(__file__).parent / "counterexamples"
EXAMPLES = {path.stem: yaml.safe_load(path.read_text(encoding="utf-8")) for path in FOLDER.glob("*.yaml")}
CLAIMS = {(name, claim.key): claim for name, path in SECTIONS.items() for claim in load_claims(path)} | {
    (name, claim.key): claim
    for name in PROTOCOLS
    for claim in load_protocol(MODELS / "protocols" / f"{name}.yaml").report.claims
}
# Every bound of every criterion, by section, key of the claim, place of the criterion, and comparison.
BOUNDS = [
    (name, key, place, how)
    for (name, key), claim in CLAIMS.items()
    for place, criterion in enumerate(claim.criteria)
    for how in criterion.bounds
]


def is_met(claim, numbers):
    (result,) = judge_claims([claim], numbers)
    return result.met


def remove_bound(claim, place, how):
    """The claim without one bound; without the criterion if that was its only one."""
    criterion = claim.criteria[place]
    less = criterion.model_copy(update={"is_" if how == "is" else how: None})
    kept = [less] if less.bounds else []
    return claim.model_copy(update={"criteria": [*claim.criteria[:place], *kept, *claim.criteria[place + 1 :]]})


def list_counterexamples(name, key):
    changes = EXAMPLES[name]["counterexamples"][key]
    return [{**EXAMPLES[name]["numbers"], **change} for change in changes]


def test_every_section_file_and_every_claim_has_numbers_that_contradict_it():
    assert {name for name, _ in CLAIMS} == set(EXAMPLES)
    contradicted = {(name, key) for name, examples in EXAMPLES.items() for key in examples["counterexamples"]}
    assert contradicted == set(CLAIMS)
    assert len(CLAIMS) > 20


def read_order(path):
    return yaml.safe_load(path.read_text(encoding="utf-8"))["order"]


def test_sections_come_in_an_order_of_their_own():
    orders = [read_order(path) for path in SECTIONS.values()]
    assert len(set(orders)) == len(orders)


@pytest.mark.parametrize(("name", "key"), CLAIMS)
def test_claim_is_met_by_numbers_that_meet_it_and_by_no_counterexample(name, key):
    claim = CLAIMS[name, key]
    assert is_met(claim, EXAMPLES[name]["numbers"])
    for numbers in list_counterexamples(name, key):
        assert not is_met(claim, numbers), numbers


@pytest.mark.parametrize(("name", "key", "place", "how"), BOUNDS)
def test_each_bound_is_needed(name, key, place, how):
    """Some numbers contradict this bound alone: the claim without the bound is met by them."""
    without = remove_bound(CLAIMS[name, key], place, how)
    assert any(is_met(without, numbers) for numbers in list_counterexamples(name, key))


@pytest.mark.parametrize(("name", "key"), CLAIMS)
def test_each_counterexample_shows_what_it_contradicts(name, key):
    """Each counterexample fails exactly one criterion, so that the report marks the one that it contradicts."""
    for numbers in list_counterexamples(name, key):
        (result,) = judge_claims([CLAIMS[name, key]], numbers)
        assert sum(not criterion.met for criterion in result.criteria) == 1, numbers


@pytest.mark.parametrize(
    "drops",
    [
        (0.2125, 0.0040, 0.0090, 0.0140),
        (0.2125, 0.0100, 0.0200, 0.0300),
        (0.2125, 0.2125, 0.2125, 0.2126),
        (0.01, 0.02, 0.03, 0.04),
    ],
)
def test_drops_that_grow_are_not_reduced(drops):
    numbers = {**EXAMPLES["weight"]["numbers"], "drop_m": list(drops)}
    assert not is_met(CLAIMS["weight", "drop_reduced"], numbers)
    assert any(later > earlier for earlier, later in itertools.pairwise(drops))


def test_order_of_trials_decides_whether_the_drop_is_reduced():
    claim, numbers = CLAIMS["weight", "drop_reduced"], EXAMPLES["weight"]["numbers"]
    for order in itertools.permutations((0.2125, 0.0400, 0.0120, 0.0060)):
        assert is_met(claim, {**numbers, "drop_m": list(order)}) == (list(order) == sorted(order, reverse=True))
