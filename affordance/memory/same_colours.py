"""Colours that two cameras see differently: each record's look is translated to one of them when it is read."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from affordance.belief.colour_recognition import find_colour_index
from affordance.exceptions import BadValueError
from affordance.memory.evidence_sums import find_material
from affordance.memory.trial_evidence import TrialEvidence
from affordance.objects.colour import Colour, find_nearest_colour, show_colour

# Pairs of colours that count as one; of each, the second is read as the first.
type SameColours = Sequence[tuple[Colour, Colour]]


def join_colours(pairs: SameColours, at_hand: Mapping[str, Colour] | None = None) -> list[tuple[Colour, Colour]]:
    """Joins pairs, chains and circles of them too, to pairs of a colour that represents all and another one.

    Args:
        pairs: Pairs of colours that count as one.
        at_hand: Colours of materials by name, each of which represents what counts as one with it; otherwise the
            colour that is named first does.

    Raises:
        BadValueError: Two colours at hand would count as one.
    """
    groups: list[list[Colour]] = []
    for pair in pairs:
        joined = [group for group in groups if any(find_colour_index(group, each) is not None for each in pair)]
        groups = [group for group in groups if group not in joined]
        groups.append(list(dict.fromkeys(each for group in (*joined, list(pair)) for each in group)))
    found = []
    for group in groups:
        named = {name: each for name, each in (at_hand or {}).items() if find_colour_index(group, each) is not None}
        first = next(iter(named.values()), group[0])
        for name, other in named.items():
            if find_colour_index([first], other) is None:
                problem = (
                    f"counts {next(iter(named))} and {name} as one, must be one material at hand and other colours"
                )
                raise BadValueError("--same-colour", "", problem)
        found += [(first, each) for each in group if find_colour_index([first], each) is None]
    return found


def translate(trials: Sequence[TrialEvidence], same_colours: SameColours, place: Path | str) -> list[TrialEvidence]:
    """Translates the colours of trials' parts; a BadValueError is raised if a pair's second colour is in none.

    Args:
        trials: All trials of a memory.
        same_colours: Pairs of colours, of which the second is read as the first.
        place: Memory, which the message names.
    """
    pairs = join_colours(same_colours)
    named = [*dict.fromkeys(one for one, _ in pairs), *(other for _, other in pairs)]
    meanings = {other: one for one, other in pairs}
    seen = list(dict.fromkeys(part for trial in trials for part in trial.parts))
    matches = {part: None if (index := find_material(part, named)) is None else named[index] for part in seen}
    for other in meanings:
        if other not in matches.values():
            raise BadValueError(place, "same colours", _describe_unknown(other, [part.colour for part in seen]))
    looks = {
        part: part if match not in meanings else part._replace(colour=meanings[match])
        for part, match in matches.items()
        if match is not None
    }
    return [replace(each, parts=tuple(looks.get(part, part) for part in each.parts)) for each in trials]


def _describe_unknown(colour: Colour, known: Sequence[Colour]) -> str:
    """Describes a colour that no part has."""
    if not known:
        return f"name {show_colour(colour)}, which a memory without trials does not know"
    nearest = find_nearest_colour(colour, {show_colour(each): each for each in known})
    return f"name {show_colour(colour)}, which no part in the memory has; the nearest is {nearest}"
