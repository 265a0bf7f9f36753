"""Colours that two cameras see differently; records are translated to one of them when they are read."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from affordance.belief.colour_recognition import find_colour_index
from affordance.exceptions import BadArgumentError, BadValueError
from affordance.extensions.memory.evidence_sums import check_materials, find_material
from affordance.extensions.memory.trial_evidence import TrialEvidence
from affordance.objects.appearance import PartAppearance
from affordance.objects.colour import Colour, find_nearest_colour, is_same_colour, show_colour

# Pairs of colours to treat as one; the second of each is read as the first.
type SameColours = Sequence[tuple[Colour, Colour]]


def join_colours(pairs: SameColours, at_hand: Mapping[str, Colour] | None = None) -> list[tuple[Colour, Colour]]:
    """Joins pairs that share colours into groups, and lists each group as pairs of its representative and another.

    A group is represented by the colour of a material at hand if it contains one, and otherwise by the colour that
    was named first.

    Raises:
        BadValueError: If the two colours of a pair look the same, or two materials at hand would be in one group.
    """
    groups: list[list[Colour]] = []
    for pair in pairs:
        if is_same_colour(*pair):
            shown = " and ".join(map(show_colour, pair))
            problem = f"joins {shown}, which already count as one material, must join two different colours"
            raise BadValueError("--same-colour", "", problem)
        joined = [group for group in groups if any(find_colour_index(group, each) is not None for each in pair)]
        groups = [group for group in groups if group not in joined]
        groups.append(list(dict.fromkeys(each for group in (*joined, list(pair)) for each in group)))
    found = []
    for group in groups:
        named = {name: each for name, each in (at_hand or {}).items() if find_colour_index(group, each) is not None}
        first = next(iter(named.values()), group[0])
        for name, other in named.items():
            if find_colour_index([first], other) is None:
                problem = f"joins {next(iter(named))} and {name}, must join one material at hand and other colours"
                raise BadValueError("--same-colour", "", problem)
        found += [(first, each) for each in group if find_colour_index([first], each) is None]
    return found


def translate(trials: Sequence[TrialEvidence], same_colours: SameColours, place: Path | str) -> list[TrialEvidence]:
    """Renames colours in all trials of a memory: the second colour of each pair becomes the first.

    Colours outside the pairs compete as materials: a part whose colour resembles one of a pair may belong to another.

    Raises:
        BadValueError: If no trial has the second colour of a pair, or there are more materials than a memory may
            have. The message names ``place``, the path of the memory.
    """
    pairs = join_colours(same_colours)
    named = [*dict.fromkeys(one for one, _ in pairs), *(other for _, other in pairs)]
    meanings = {other: one for one, other in pairs}
    seen = list(dict.fromkeys(part for trial in trials for part in trial.parts))
    try:
        known = _list_materials(seen, named)
    except BadArgumentError as error:
        raise BadValueError(place, str(error.source), error.problem) from error
    matches = {part: None if (index := find_material(part, known)) is None else known[index] for part in seen}
    for other in meanings:
        if other not in matches.values():
            raise BadValueError(place, "same colours", _describe_unknown(other, [part.colour for part in seen]))
    looks = {
        part: part if match not in meanings else part._replace(colour=meanings[match])
        for part, match in matches.items()
        if match is not None
    }
    return [replace(each, parts=tuple(looks.get(part, part) for part in each.parts)) for each in trials]


def _list_materials(seen: Sequence[PartAppearance], named: Sequence[Colour]) -> list[Colour]:
    """Lists the named colours, followed by the other materials of the parts."""
    founders: dict[Colour, PartAppearance] = {}
    for part in seen:
        if find_material(part, list(founders)) is None:
            founders[part.colour] = part
            check_materials(len(founders))
    met = {show_colour(each): each for each in founders}
    others = list(founders)
    for index, colour in enumerate(named if met else ()):
        nearest = met[find_nearest_colour(colour, met)]
        if nearest in others and find_material(founders[nearest], named) == index:
            others.remove(nearest)
    return [*named, *others]


def _describe_unknown(colour: Colour, known: Sequence[Colour]) -> str:
    """Describes a colour that no part in the memory has."""
    if not known:
        return f"name {show_colour(colour)}, which a memory without trials does not know"
    nearest = find_nearest_colour(colour, {show_colour(each): each for each in known})
    return f"name {show_colour(colour)}, which no part in the memory has; the nearest is {nearest}"
