"""Trial tables from short descriptions of blocks, with orders balanced over participants."""

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from affordance.exceptions import BadValueError, describe_choice
from affordance.extensions.people.experiments.lifts import build_table, count_rows, repeat

# Names of orders on the command line, and in ``lifts.repeat``.
ORDERS = {"latin": "latin square", "shuffled": "shuffled", "fixed": "fixed"}
# Largest number of rows of a table.
MOST_ROWS = 200_000
_FORM = "must be '[GROUP/]PHASE: [FIRST, ... >] OBJECT[=KG], ... [x CYCLES]', such as 'learn: small, large=0.6 x 5'"
_BLOCK = re.compile(r"(?:(?P<group>[^/:]+)/)?(?P<phase>[^/:]+):(?P<objects>.+?)(?:\s+x\s*(?P<cycles>\d{1,4}))?\s*")


class Block(NamedTuple):
    """Block of trials, consisting of cycles with every object once.

    Attributes:
        group: Group with this block; empty for all groups.
        phase: Name of the block.
        first: Objects at the start of each cycle, in this order.
        others: Remaining objects of each cycle, in varying order.
        masses: Changed masses, [kg], as strings, by object.
        cycles: Number of cycles.
    """

    group: str
    phase: str
    first: tuple[str, ...]
    others: tuple[str, ...]
    masses: dict[str, str]
    cycles: int


def parse_block(text: str, known: Sequence[str], groups: Sequence[str]) -> Block:
    """Parses the description of a block, in which ``all`` stands for all objects.

    Args:
        text: Description, such as "learn: small, large x 5", "A/test: odd=1.2 > small, large x 40", "learn: all x 3".
        known: Names of the objects.
        groups: Names of the groups.

    Raises:
        BadValueError: The description is malformed, has an unknown group or object, or names an object twice.
    """
    if not (found := _BLOCK.fullmatch(text)):
        raise BadValueError("--block", "", f"is {text!r}, {_FORM}")
    group, phase = ((found[name] or "").strip() for name in ("group", "phase"))
    if group and group not in groups:
        raise BadValueError("--block", text, f"group {describe_choice(group, groups)}")
    masses: dict[str, str] = {}
    names: list[list[str]] = []
    for part in found["objects"].split(" > "):
        names.append([])
        for word in part.split(","):
            name, _, mass = (each.strip() for each in word.partition("="))
            if name != "all" and name not in known:
                raise BadValueError("--block", text, f"object {describe_choice(name, [*known, 'all'])}")
            own = list(known) if name == "all" else [name]
            names[-1] += own
            masses |= dict.fromkeys(own, mass) if mass else {}
    everything = [name for part in names for name in part]
    if len(names) > 2 or len(set(everything)) < len(everything):
        problem = "has more than one ' > '" if len(names) > 2 else "has an object twice in a cycle; use x CYCLES"
        raise BadValueError("--block", text, problem)
    first = names[0] if len(names) == 2 else []
    cycles = int(found["cycles"] or 1)
    if cycles < 1:
        raise BadValueError("--block", text, "has 0 cycles, must have at least 1")
    return Block(group, phase, tuple(first), tuple(names[-1]), masses, cycles)


def build_trials(
    blocks: Sequence[Block], participants: int, *, groups: Sequence[str], order: str, seed: int
) -> pd.DataFrame:
    """Builds a trial table, and assigns participants P1, P2, ... to the groups in turn.

    With the order ``latin``, participant n of each group starts with row n of a Latin square, and continues with the
    next row in each cycle.

    Raises:
        BadValueError: A group has no block, there are more groups than participants, or the table is too long.
    """
    if len(groups) > participants:
        problem = f"is {participants}, must be at least {len(groups)}, one for each group"
        raise BadValueError("--participants", "", problem)
    for group in groups:
        if not any(block.group in ("", group) for block in blocks):
            raise BadValueError("--block", "", f"is missing for group {group}, must be given once at least")
    rows = participants * sum(block.cycles * len((*block.first, *block.others)) for block in blocks)
    if rows > MOST_ROWS:
        raise BadValueError("--block", "", f"would give up to {rows} trials, must give at most {MOST_ROWS}")

    def design(number: int, rng: np.random.Generator) -> pd.DataFrame:
        row, group = number // len(groups), groups[number % len(groups)]
        parts = []
        for block in blocks:
            if block.group in ("", group):
                objects = (*block.first, *block.others)
                part = repeat(
                    objects, block.cycles, rng, block=block.phase, order=ORDERS[order], first=block.first, row=row
                )
                parts.append(part.assign(mass=[block.masses.get(name, "") for name in part["object"]]))
        return pd.concat(parts, ignore_index=True)

    table = build_table(design, participants, groups=groups, seed=seed).assign(do="lift")
    return table if (table["mass"] != "").any() else table.drop(columns="mass")


def describe_balance(blocks: Sequence[Block], participants: int, groups: Sequence[str], order: str) -> str:
    """Describes the balance of orders over the participants of a group."""
    if order != "latin":
        return f"Orders are {order}, and not balanced over participants."
    sizes = [(participants - place - 1) // len(groups) + 1 for place in range(len(groups))]
    rows = int(np.lcm.reduce([count_rows(len(block.others)) for block in blocks]))
    if all(size % rows == 0 for size in sizes):
        return "Orders are balanced over the participants of each group."
    better = len(groups) * rows * max(1, round(participants / (len(groups) * rows)))
    shown = " and ".join(str(size) for size in dict.fromkeys(sizes))
    return f"Orders are not balanced: {shown} participants in a group, not a multiple of {rows}. Try {better} in all."
