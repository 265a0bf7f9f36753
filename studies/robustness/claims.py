"""The claims that every setting is asked about: those of the protocols, and headlines of the README."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from affordance.files.bounded import read_yaml
from affordance.files.data_model import check_content
from affordance.files.model_folder import MODELS
from affordance.protocols.protocol import find_protocol, load_protocol
from affordance.reporting.claims import Claim, judge_claims
from affordance.reporting.expressions import find_names

_HEADLINES = Path(__file__).parent / "headlines.yaml"
EXPERIMENTS = ("weight", "com", "reach", "hammer")
TASKS = "tasks"


@cache
def list_claims() -> Mapping[str, Claim]:
    """All claims, by experiment and key, such as ``weight.drop_reduced``."""
    claims = {
        f"{name}.{claim.key}": claim
        for name in EXPERIMENTS
        for claim in load_protocol(find_protocol(name, MODELS)).report.claims
    }
    for name, entries in read_yaml(_HEADLINES).items():
        headlines = [check_content(_HEADLINES, name, entry, Claim) for entry in entries]
        claims |= {f"{name}.{claim.key}": claim for claim in headlines}
    return claims


def judge(numbers: Mapping[str, Mapping[str, Any]]) -> dict[str, float]:
    """Judges every claim: 1 if it holds, 0 if not; not a number where a number that it names was not found.

    Numbers are by experiment; those that could not be run have none.
    """
    outcomes = {}
    for name, claim in list_claims().items():
        known = numbers.get(name.split(".")[0], {})
        named = {
            key
            for criterion in claim.criteria
            for expression in (criterion.value, *criterion.bounds.values())
            for key in find_names(expression)
        }
        missing = not known or any(known.get(key, 0) is None for key in named)
        outcomes[name] = float("nan") if missing else float(judge_claims([claim], known)[0].met)
    return outcomes
