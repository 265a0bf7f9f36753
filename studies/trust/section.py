"""What the studies of trust and scale found, as a section of the report."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from affordance.reporting.section import Section, render_section

SECTION = Path(__file__).with_name("trust.yaml")
# What of each fault its claim is about; limits must be kept without a fault too.
_OF_FAULTS = ("torque_of_limit", "velocity_of_limit", "violation_rad", "beliefs_valid")


def describe(numbers: Mapping[str, Any]) -> Section:
    """Puts the numbers of all studies into a section of the report."""
    return render_section(SECTION, numbers, list_facts(numbers))


def list_facts(numbers: Mapping[str, Any]) -> dict[str, Any]:
    """What the section file names beside the numbers: those of all faults in one list each, and the programs."""
    of_faults = {f"faults_{key}": [cost[key] for cost in numbers["faults"].values()] for key in _OF_FAULTS}
    return {**of_faults, "num_programs": len(set(numbers["program"].values()))}
