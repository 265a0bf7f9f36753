"""Colours that two cameras see differently: each record's look is translated to one of them when it is read."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from affordance.belief.colour_recognition import find_colour_index
from affordance.exceptions import BadArgumentError, BadValueError
from affordance.memory.evidence_sums import check_materials, find_material
from affordance.memory.trial_evidence import TrialEvidence
from affordance.objects.appearance import PartAppearance
from affordance.objects.colour import Colour, find_nearest_colour, is_same_colour, show_colour

# Pairs of colours that count as one; of each, the second is read as the first.
type SameColours = Sequence[tuple[Colour, Colour]]


def join_colours(pairs: SameColours, at_hand: Mapping[str, Colour] | None = None) -> list[tuple[Colour, Colour]]:
    """Joins pairs, chains and circles of them too, to pairs of a colour that represents all and another one.

    Colours of materials at hand, by name, represent what counts as one with them; otherwise the colour that is named
    first does. A pair that looks the same, or two colours at hand that would count as one, raise a BadValueError.
    """
    groups: list[list[Colour]] = []
    for pair in pairs:
        if is_same_colour(*pair):
            shown = " and ".join(map(show_colour, pair))
            problem = f"counts {shown} as one, which are one material already, must be two that look unlike"
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
                problem = (
                    f"counts {next(iter(named))} and {name} as one, must be one material at hand and other colours"
                )
                raise BadValueError("--same-colour", "", problem)
        found += [(first, each) for each in group if find_colour_index([first], each) is None]
    return found


def translate(trials: Sequence[TrialEvidence], same_colours: SameColours, place: Path | str) -> list[TrialEvidence]:
    """Renames colours in all trials of a memory: the second colour of each pair becomes the first.

    Colours of the records that are of no pair are materials too, for which a part that is like a pair's may be taken.
    A BadValueError, which names the memory's place, is raised if a pair's second colour is in no trial, or if there
    are more materials than a memory may have.
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
    """Lists the named colours, and those of the parts' materials that are others."""
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
    """Describes a colour that no part has."""
    if not known:
        return f"name {show_colour(colour)}, which a memory without trials does not know"
    nearest = find_nearest_colour(colour, {show_colour(each): each for each in known})
    return f"name {show_colour(colour)}, which no part in the memory has; the nearest is {nearest}"
