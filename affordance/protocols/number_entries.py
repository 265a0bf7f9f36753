"""Numbers of a protocol: measures of every observer, and their summaries over observers."""

import enum
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from affordance.exceptions import describe_choice
from affordance.files.constraints import OneOf, Text, Whole, Within, complain
from affordance.files.data_model import DataModel
from affordance.protocols import ALL
from affordance.reporting.claims import Expression


class Measure(enum.StrEnum):
    """Measures of observers and objects; SI units."""

    # Measures of every presentation.
    FORCE = "force"  # upward force before release from a clamp
    WEIGHT = "weight"  # true weight
    FOUNDS_KIND = "founds a kind"  # 1 if one kind more is remembered after it than before, else 0
    EXPECTED_MASS = "expected mass"  # at the most probable densities, before the object is felt
    DROP = "drop"  # largest descent of the object's geometric centre
    LIFT = "lift"  # largest rise of the geometric centre
    EXCURSION = "excursion"  # height of largest magnitude, with its sign
    EXCURSION_GRIP = "excursion of the grip"
    EXCURSION_CENTRE_OF_MASS = "excursion of the centre of mass"
    DEVIATION = "deviation"  # the magnitude of the excursion
    RISES = "rises"  # 1 if the excursion is upward, else 0
    WORK = "work"  # mechanical, without recovery
    PATH_ERROR = "path error"  # largest distance from the path
    LOG_EVIDENCE = "log evidence"
    P_VALUE = "p value"
    OUTLIER = "outlier"  # 1 if it is a 5-sigma outlier, else 0
    PERIODS_LIMITED = "periods limited"  # control periods in which a limit is active
    PERIODS_FAILED = "periods failed"
    SAMPLES_REJECTED = "samples rejected"
    MASS_ERROR = "mass error"  # relative error of the expected mass
    COM_ERROR = "centre of mass error"
    INERTIA_ERROR = "inertia error"  # relative error of the moments of inertia about the grip
    PLACE = "place"  # among the measured presentations, from 1
    STOPPED = "stopped"  # 1 if, by now, the observer who chooses would rather hold nothing more, else 0
    # Measures before the first presentation and after each.
    DENSITY = "believed density"  # of the first material, a quantile of the belief
    DENSITY_MODE = "most probable density"
    # Measures after the presentations that precede the measured ones, by material.
    DENSITIES = "believed densities"
    # Measures of the objects, whatever observers do.
    TRUE_MASS = "true mass"
    TRUE_CENTRE_OF_MASS = "true centre of mass"  # along the tool from the grip
    TRUE_DENSITY = "true density"  # of the first part of the first object
    TRUE_DENSITIES = "true densities"  # by material


# Measures of the objects alone.
OF_OBJECTS = (Measure.TRUE_MASS, Measure.TRUE_CENTRE_OF_MASS, Measure.TRUE_DENSITY, Measure.TRUE_DENSITIES)
# Measures before the first presentation and after each.
MOMENTS = (Measure.DENSITY, Measure.DENSITY_MODE)
# Keys that every number may have, and those that define how presentations become one number.
_COMMON = {"meaning", "people"}
_WAYS = {"first", "last", "single", "growth", "predicted_for", "correlated_with"}
# Ways that exclude each other.
_ALONE = (
    {"single", "first", "last"},
    {"single", "predicted_for", "correlated_with"},
    {"growth", "predicted_for", "correlated_with"},
)


class SpreadEntry(DataModel):
    """Standard deviation of a number between people, in addition to that between simulated observers."""

    sd: Annotated[float, Within(0.0), Field(description="Standard deviation between people.")]
    unit: Annotated[str, Text(), Field(description="Unit of the number; 1 if it has none.")]
    source: Annotated[str, Text(), Field(description="Source of the number.")]


class NumberEntry(DataModel):
    """Entry of a number of metrics.json."""

    measure: Annotated[Annotated[Measure, OneOf(Measure)] | None, Field(description="Measured quantity.")] = None
    expression: Annotated[
        Annotated[str, Expression()] | None,
        Field(description="Expression of numbers above it, evaluated for every observer, in place of a measure."),
    ] = None
    meaning: Annotated[str, Field(description="Meaning of the number in words, with its unit.")] = ""
    of: Annotated[str, Text(), Field(description="Presentations of this group of objects only.")] = ALL
    first: Annotated[
        Annotated[int, Whole(1, 100_000)] | None,
        Field(description="Number of first presentations whose mean is taken."),
    ] = None
    last: Annotated[
        Annotated[int, Whole(1, 100_000)] | None,
        Field(description="Number of last presentations whose mean is taken."),
    ] = None
    predicted_for: Annotated[
        Annotated[str, Text()] | None,
        Field(description="Group for whose first object the value of a line through measure and volume is given."),
    ] = None
    correlated_with: Annotated[
        Annotated[Measure, OneOf(Measure)] | None,
        Field(description="Measure with which the correlation is taken, in place of the mean."),
    ] = None
    growth: Annotated[bool, Field(description="True for the change from each presentation to the next.")] = False
    quantile: Annotated[float, Within(0.0, 1.0), Field(description="Quantile of a belief.")] = 0.5
    single: Annotated[
        bool, Field(description="True for the value of the first such presentation, not a list of them.")
    ] = False
    over: Annotated[
        Literal["mean", "median", "sum", "median of all"],
        Field(description="Statistic over observers; 'median of all': over all presentations too."),
    ] = "mean"
    interval: Annotated[bool, Field(description="True to add the 95 % interval of the mean, as NAME_ci95.")] = False
    people: Annotated[
        SpreadEntry | None,
        Field(description="Spread between people with which predictions of learners are compared."),
    ] = None

    @property
    def chosen(self) -> slice:
        """First or last presentations that are asked for; all where neither is given."""
        return slice(None, self.first) if self.last is None else slice(-self.last, None)

    @model_validator(mode="after")
    def check_ways(self) -> Self:
        """Refuses contradictory or incomplete entries."""
        if (self.measure is None) == (self.expression is None):
            raise complain("must have either 'measure' or 'expression'")
        if self.first is not None and self.last is not None:
            raise complain(f"is {self.last}, must not be given with 'first'", "last")
        if self.interval and self.over != "mean":
            raise complain(f"is true, must be false where observers are taken together by {self.over!r}", "interval")
        if self.correlated_with in (*MOMENTS, *OF_OBJECTS, Measure.DENSITIES):
            known = [each.value for each in Measure if each not in (*MOMENTS, *OF_OBJECTS, Measure.DENSITIES)]
            problem = f"{describe_choice(self.correlated_with.value, known)}; that is of each presentation"
            raise complain(problem, "correlated_with")
        self._check_keys()
        return self

    def _check_keys(self) -> None:
        """Refuses keys that would have no effect."""
        given = self.model_fields_set - _COMMON - {"measure", "expression"}
        what = "an expression" if self.measure is None else f"the measure {self.measure.value!r}"
        for key in sorted(given - self._list_keys()):
            raise complain(f"is given, must be omitted for {what}, on which it has no effect", key)
        for ways in _ALONE:
            first, *others = sorted(ways & given, key=list(NumberEntry.model_fields).index)[:2] or [""]
            if others:
                raise complain(f"is given, must be omitted with {first!r}", others[0])

    def _list_keys(self) -> set[str]:
        """Lists the keys that have an effect on such a number."""
        if self.measure is None:
            return {"over", "interval"}
        if self.measure in OF_OBJECTS:
            return {"of", "single"}
        if self.measure is Measure.DENSITIES:
            return {"of", "quantile"}
        quantile = {"quantile"} if self.measure is Measure.DENSITY else set()
        ways = _WAYS - {"predicted_for", "correlated_with"} if self.measure in MOMENTS else _WAYS
        return {"of", "over", "interval", *quantile, *ways}


# Keys of groups by the kind of figure.
_DRAWN = {
    "objects": ("of", "decoy"),
    "heights": ("of",),
    "heights of points": ("of", "decoy"),
    "density and drop": ("of",),
    "lifts": ("of", "predicted_from"),
}


class FigureEntry(DataModel):
    """Entry of a figure, by the kind of drawing."""

    draw: Annotated[
        Literal["objects", "heights", "heights of points", "density and drop", "lifts"],
        Field(description="Kind of the drawing."),
    ]
    of: Annotated[str, Text(), Field(description="Group that is drawn.")] = ALL
    decoy: Annotated[
        Annotated[str, Text()] | None,
        Field(description="Group of an object that is made otherwise than it looks."),
    ] = None
    predicted_from: Annotated[
        Annotated[str, Text()] | None, Field(description="Group whose forces predict those drawn, of lifts.")
    ] = None
    title: Annotated[str, Field(description="Title of the drawing.")] = ""

    @model_validator(mode="after")
    def check_keys(self) -> Self:
        """Refuses keys that have no effect on such a figure."""
        known = {"draw", "title", *_DRAWN[self.draw]}
        for key in sorted(self.model_fields_set - known):
            raise complain(f"is given, must be omitted for the figure {self.draw!r}, on which it has no effect", key)
        return self
