"""Report section of the studies of trust and scale."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from affordance.reporting.section import Section, render_section

SECTION = Path(__file__).with_name("trust.yaml")
# Keys of each fault that its claim uses; limits must be respected without a fault too.
_OF_FAULTS = ("torque_of_limit", "velocity_of_limit", "violation_rad", "beliefs_valid")


def describe(numbers: Mapping[str, Any]) -> Section:
    """Builds the section of the report from the numbers of all studies."""
    return render_section(SECTION, numbers, list_facts(numbers))


def list_facts(numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Returns facts of the section file other than the numbers: lists over faults, and the number of programs."""
    of_faults = {f"faults_{key}": [cost[key] for cost in numbers["faults"].values()] for key in _OF_FAULTS}
    return {**of_faults, "num_programs": len(set(numbers["program"].values()))}
