"""Planned contrasts: parsing, effects, and required sample sizes.

Contrasts have the form ``MEASURE: ONE - OTHER [in PLACE, ...]``, for example ``force: large - small in test``. ONE
and OTHER are two objects, groups, phases, or first and last lifts (``last 3``). OTHER can also be a number. Objects,
phases and lifts are compared within participants, groups between participants.
"""

import itertools
import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.special import stdtr, stdtrit  # not scipy.stats, which takes half a second to import

from affordance.arrays import Array
from affordance.exceptions import BadValueError, describe_choice
from affordance.extensions.people.experiments.prediction import MANY, POWER, SIGNIFICANCE, count_people
from affordance.extensions.people.experiments.trial_cells import PEOPLE

# Measures of a lift, [N].
MEASURES = ("force", "heaviness", "felt")
_FORM = "must be 'MEASURE: ONE - OTHER [in PLACE, ...]', such as 'force: large - small in test'"
_CONTRAST = re.compile(r"(?P<measure>\w+)\s*:\s*(?P<one>.+?)\s+-\s+(?P<other>.+?)(?:\s+in\s+(?P<places>.+))?\s*")
_ENDS = re.compile(r"(first|last)(?: (\d{1,4}))?")
_KINDS = ("object", "group", "phase")
_LIFTS = "lifts"  # kind of a level with first or last lifts


class Level(NamedTuple):
    """Level of a contrast: an object, group or phase, or the first or last lifts of each object."""

    kind: str
    name: str
    number: int = 0  # number of first lifts if positive, of last lifts if negative


class PlannedContrast(NamedTuple):
    """Difference between two levels, or between a level and a number."""

    text: str
    measure: str
    one: Level
    other: Level | float
    places: tuple[Level, ...]  # levels to which the contrast is limited

    @property
    def groups(self) -> int:
        """Number of groups in the t test: 2 for a comparison between participants, otherwise 1."""
        return 2 if self.one.kind == "group" and isinstance(self.other, Level) else 1

    @property
    def test(self) -> str:
        """Name of the t test."""
        if not isinstance(self.other, Level):
            return "one-sample t test"
        return "t test between groups" if self.groups == 2 else "paired t test"


class Effect(NamedTuple):
    """Effect of a contrast for observers of a learner or for human participants."""

    mean: float
    low: float  # lower end of the 95 % interval
    high: float  # upper end
    sd: float  # between participants
    counts: tuple[int, ...]  # group sizes
    p_value: float  # two-sided

    @property
    def free(self) -> int:
        """Degrees of freedom."""
        return sum(self.counts) - len(self.counts)


def parse_contrast(text: str, rows: pd.DataFrame) -> PlannedContrast:
    """Parses a contrast, and checks that a table has trials for it.

    Raises:
        BadValueError: The form is wrong, a name is unknown or ambiguous, or a level has no trials.
    """

    def complain(problem: str) -> BadValueError:
        return BadValueError("--contrast", "", f"is {text!r}: {problem}")

    if not (found := _CONTRAST.fullmatch(text.strip())):
        raise BadValueError("--contrast", "", f"is {text!r}, {_FORM}")
    if (measure := found["measure"]) not in MEASURES:
        raise complain(f"measure {describe_choice(measure, MEASURES)}")
    names = {kind: list(dict.fromkeys(rows[kind])) for kind in _KINDS}

    def find(word: str) -> Level:
        if ends := _ENDS.fullmatch(word):
            count = int(ends[2] or 1)
            return Level(_LIFTS, word, count if ends[1] == "first" else -count)
        kind, equals, name = word.partition("=")
        if equals and kind.strip() in _KINDS:
            kinds, word = [kind.strip()], name.strip()
            known = names[kinds[0]]
        else:
            kinds = [kind for kind in _KINDS if word in names[kind]]
            known = [*dict.fromkeys(name for each in names.values() for name in each), "first", "last"]
        if not kinds or word not in known:
            raise complain(describe_choice(word, known))
        if len(kinds) > 1:
            raise complain(f"{word!r} is {' and '.join(kinds)}; write {kinds[0]}={word}")
        return Level(kinds[0], word)

    one = find(found["one"])
    try:
        other: Level | float = float(found["other"])
    except ValueError:
        other = find(found["other"])
    places = tuple(find(word.strip()) for word in (found["places"] or "").split(",") if word.strip())
    if isinstance(other, Level) and (other.kind != one.kind or other == one):
        problem = "are the same" if other == one else f"are {one.kind} and {other.kind}, must be of one kind"
        raise complain(f"{one.name} and {other.name} {problem}")
    kinds = [one.kind, *(place.kind for place in places)]
    if len(set(kinds)) < len(kinds):
        raise complain(f"{next(kind for kind in kinds if kinds.count(kind) > 1)} is given twice")
    contrast = PlannedContrast(text.strip(), measure, one, other, places)
    lifts = rows[rows["measured"] & (rows["do"] == "lift")]
    persons = [set(_select(lifts, level, places, "participant")["participant"]) for level in _list_levels(contrast)]
    for level, own in zip(_list_levels(contrast), persons, strict=True):
        if not own:
            raise complain(f"the table has no lift of {', '.join(each.name for each in (level, *places))}")
    if len(persons) == 2 and contrast.groups == 1 and not set.intersection(*persons):
        raise complain("no participant does both")
    return contrast


def compute_effect(contrast: PlannedContrast, lifts: pd.DataFrame) -> Effect | None:
    """Computes the effect of a contrast from the lifts of observers or human participants.

    Lifts are first averaged for each participant and level. Interval and p-value come from a paired t test, from a
    one-sample t test for a number or, between groups, from a t test with pooled variance.

    Returns: Effect; None for fewer than two participants.
    """
    measured = lifts[lifts["measured"] & lifts[contrast.measure].notna()]
    one, *others = (
        _select(measured, level, contrast.places, "observer").groupby("observer")[contrast.measure].mean()
        for level in _list_levels(contrast)
    )
    samples = [one.to_numpy(), others[0].to_numpy()] if contrast.groups == 2 else [_subtract(contrast, one, others)]
    counts = tuple(map(len, samples))
    if min(counts) < 2:
        return None
    mean = float(samples[0].mean() - (samples[1].mean() if len(samples) == 2 else 0.0))
    free = sum(counts) - len(counts)
    sd = math.sqrt(sum(((each - each.mean()) ** 2).sum() for each in samples) / free)
    error = sd * math.sqrt(sum(1.0 / count for count in counts))
    half = float(stdtrit(free, 0.975)) * error
    statistic = mean / error if error > 0.0 else math.copysign(math.inf, mean) if mean else 0.0
    return Effect(mean, mean - half, mean + half, sd, counts, float(2.0 * stdtr(free, -abs(statistic))))


def _list_levels(contrast: PlannedContrast) -> list[Level]:
    return [level for level in (contrast.one, contrast.other) if isinstance(level, Level)]


def _subtract(contrast: PlannedContrast, one: pd.Series, others: Sequence[pd.Series]) -> Array:
    """Computes the difference for each participant with data in all levels."""
    other = others[0] if others else contrast.other
    return np.asarray((one - other).dropna(), dtype=float)


def _select(lifts: pd.DataFrame, level: Level, places: Sequence[Level], person: str) -> pd.DataFrame:
    """Selects the lifts of a level in some places. First and last lifts are selected per object and phase."""
    levels = sorted((level, *places), key=lambda each: each.kind == _LIFTS)
    for each in levels:
        if each.kind == _LIFTS:
            own = lifts.groupby([person, "phase", "object"], sort=False)
            lifts = own.head(each.number) if each.number > 0 else own.tail(-each.number)
        else:
            lifts = lifts[lifts[each.kind] == each.name]
    return lifts


def compute_effects(contrasts: Sequence[PlannedContrast], lifts: pd.DataFrame) -> list[dict[str, Effect]]:
    """Computes the effect of each contrast for all learners and, if measured, for human participants."""
    found = []
    for contrast in contrasts:
        each = {str(who): compute_effect(contrast, own) for who, own in lifts.groupby("learner", sort=False)}
        found.append({who: effect for who, effect in each.items() if effect is not None})
    return found


def describe_effects(contrast: PlannedContrast, effects: Mapping[str, Effect]) -> str:
    """Describes the effects of a contrast in one sentence, with a t test for human participants."""
    if not effects:
        return f"{contrast.text}: fewer than two persons, too few for an effect; --repeats N simulates more."
    parts = []
    for who, effect in effects.items():
        text = f"{who} {effect.mean:.3g} N [{effect.low:.3g}, {effect.high:.3g}]"
        if who == PEOPLE:
            ratio = 0.0 if effect.sd == 0.0 else _find_statistic(effect)
            text += f" ({contrast.test}, t({effect.free}) = {ratio:.3g}, p = {effect.p_value:.2g})"
        parts.append(text)
    return f"{contrast.text}: {', '.join(parts)}."


def _find_statistic(effect: Effect) -> float:
    return effect.mean / (effect.sd * math.sqrt(sum(1.0 / count for count in effect.counts)))


class Sizes(NamedTuple):
    """Required numbers of participants per group for a contrast.

    Attributes:
        find: Number for a significant contrast if humans learn like the learner, by learner.
        reject: Number for rejecting the prediction of one learner if humans learn like another, by pair.
        sd: SD between human participants, [N]; None if only the SD between observers is known.
        significance: Two-sided significance level of each test.
        power: Power of each test.
    """

    find: Mapping[str, float]
    reject: Mapping[tuple[str, str], float]
    sd: float | None
    significance: float
    power: float


def count_for(
    contrast: PlannedContrast,
    effects: Mapping[str, Effect],
    people_sd: float | None,
    *,
    contrasts: int = 1,
    power: float = POWER,
) -> Sizes:
    """Computes required numbers of participants for a contrast, with Bonferroni correction.

    Args:
        contrast: Contrast.
        effects: Effects of the contrast by learner, and for human participants if they were measured.
        people_sd: SD of the contrast between human participants, [N]; None to use the measured SD if there is one.
        contrasts: Number of planned contrasts, by which the significance level .05 is divided.
        power: Power of each test.
    """
    known = people_sd if people_sd is not None else effects[PEOPLE].sd if PEOPLE in effects else None
    learners = {who: effect for who, effect in effects.items() if who != PEOPLE}
    significance = SIGNIFICANCE / contrasts

    def count(difference: float, variance: float) -> float:
        sd = math.sqrt(variance + (known or 0.0) ** 2)
        effect = difference / sd if sd > 0.0 else math.inf if difference else 0.0
        return count_people(effect, power, groups=contrast.groups, significance=significance)

    find = {who: count(effect.mean, effect.sd**2) for who, effect in learners.items()}
    reject = {
        (one, other): count(
            learners[one].mean - learners[other].mean, 0.5 * (learners[one].sd ** 2 + learners[other].sd ** 2)
        )
        for one, other in itertools.combinations(learners, 2)
    }
    return Sizes(find, reject, known, significance, power)


def describe_sizes(contrast: PlannedContrast, sizes: Sizes) -> str:
    """Describes the required numbers of participants for a contrast in two sentences."""
    spread = "observers' SD, as that between people is not known" if sizes.sd is None else f"SD {sizes.sd:.3g} N"
    each = " in each group" if contrast.groups == 2 else ""
    levels = f"two-sided {sizes.significance:.3g}, power {sizes.power:.2g}".replace("0.", ".")
    find = ", ".join(f"{_show(count)} if they learn like {who}" for who, count in sizes.find.items())
    text = f"To find it, a {contrast.test} ({levels}, {spread}) needs{each} {find}."
    if sizes.reject:
        pairs = ", ".join(f"{_show(count)} for {one} or {other}" for (one, other), count in sizes.reject.items())
        text += f" To show that it is not what the other of two learners predicts it needs{each} {pairs}."
    return text


def _show(count: float) -> str:
    return "no number of people" if math.isinf(count) else f"{count:.0f}" if count <= MANY else f"more than {MANY}"


def list_content(
    contrasts: Sequence[PlannedContrast], effects: Sequence[Mapping[str, Effect]], sizes: Sequence[Sizes] = ()
) -> list[dict[str, Any]]:
    """Builds the JSON content of contrasts, effects and required sample sizes; null means that no size suffices."""
    content = []
    for number, (contrast, own) in enumerate(zip(contrasts, effects, strict=True)):
        each: dict[str, Any] = {
            "contrast": contrast.text,
            "test": contrast.test,
            "unit": "N",
            "effects": {
                who: {
                    "mean": effect.mean,
                    "mean_ci95": [effect.low, effect.high],
                    "sd": effect.sd,
                    "persons": list(effect.counts),
                    **({"p_value": effect.p_value} if who == PEOPLE else {}),
                }
                for who, effect in own.items()
            },
        }
        if sizes:
            size = sizes[number]
            each["people_to_find"] = {who: count if np.isfinite(count) else None for who, count in size.find.items()}
            each["people_to_reject"] = {
                f"{one} or {other}": count if np.isfinite(count) else None
                for (one, other), count in size.reject.items()
            }
            each |= {"sd_between_people": size.sd, "significance": size.significance, "power": size.power}
        content.append(each)
    return content
