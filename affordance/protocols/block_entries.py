"""Blocks of a protocol: objects, their order, and the action of a presentation."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from affordance.files.constraints import Name, Text, Whole, Within, complain
from affordance.files.data_model import DataModel
from affordance.protocols import ALL

# Longest presentation, [s], and largest number of repetitions of a block.
_DURATION_MAX, _PRESENTATIONS_MAX = 60.0, 1000

type Seconds = Annotated[float, Within(0.05, _DURATION_MAX)]


class HoldEntry(DataModel):
    """Action of holding the object in the arm's home posture."""

    duration: Annotated[Seconds, Field(description="Duration of the hold, [s].")] = 3.0


class ClampEntry(DataModel):
    """Action of pushing up against a clamp with the believed weight, and holding the object after release."""

    duration: Annotated[Seconds, Field(description="Time for which the object is held after release, [s].")] = 1.0
    closed_form: Annotated[
        bool,
        Field(
            description="True to compute the arm at rest in closed form, for hundreds of lifts; false to simulate it."
        ),
    ] = True


class ReachEntry(DataModel):
    """Action of moving the free end of the object along a path."""

    path: Annotated[str, Text(), Field(description="A path file.")] = "paths/reach.yaml"


class ChooseEntry(DataModel):
    """Choice of the grip that needs the least expected work for a task; the object is not held."""

    reach: Annotated[Annotated[str, Text()] | None, Field(description="The path file of a reach.")] = None
    hammer: Annotated[Annotated[str, Text()] | None, Field(description="The nail file of a blow.")] = None

    @model_validator(mode="after")
    def check_task(self) -> Self:
        """Refuses a choice without a task or with two."""
        if (self.reach is None) == (self.hammer is None):
            raise complain("must have either 'reach' or 'hammer'")
        return self


class LookEntry(DataModel):
    """Action of only looking at the object: nothing is felt, and the observer's expectation is recorded."""


class ActionEntry(DataModel):
    """Action of a presentation: exactly one of these."""

    hold: HoldEntry | None = None
    clamp: ClampEntry | None = None
    reach: ReachEntry | None = None
    choose: ChooseEntry | None = None
    look: LookEntry | None = None

    @model_validator(mode="after")
    def check_one(self) -> Self:
        """Refuses presentations without an action or with several."""
        done = [name for name in ActionEntry.model_fields if getattr(self, name) is not None]
        if len(done) != 1:
            known = ", ".join(ActionEntry.model_fields)
            raise complain(f"has {' and '.join(done) or 'nothing'}, must have one of {known}")
        return self

    @property
    def duration(self) -> float:
        """Time for which the object is in the hand, [s]; 0 if it is not held."""
        held = self.hold or self.clamp
        return 0.0 if held is None else held.duration


class GradualEntry(DataModel):
    """Object whose weight changes linearly from the first repetition to the last, by its density."""

    object: Annotated[Name, Field(description="Name of the object.")]
    mass_from: Annotated[float, Within(1e-3, 100.0), Field(description="Mass in the first repetition, [kg].")]
    mass_to: Annotated[float, Within(1e-3, 100.0), Field(description="Mass in the last repetition, [kg].")]


class BlockEntry(DataModel):
    """Block of presentations of some objects, each once per repetition."""

    name: Annotated[Name, Field(description="Name of the block, unlike all others.")]
    objects: Annotated[str, Text(), Field(description="Group of objects that are presented.")] = ALL
    repetitions: Annotated[
        int, Whole(1, _PRESENTATIONS_MAX), Field(description="Times that each object is presented.")
    ] = 1
    order: Annotated[
        Literal["fixed", "shuffled", "latin square", "chosen"],
        Field(
            description="Order within a repetition: as listed, drawn anew each time, by the observer's row of a "
            "Latin square, in which each object comes once in each place and follows each other one equally often, "
            "or chosen by the observer, who takes up next what is worth most for the tasks of 'chosen for'."
        ),
    ] = "fixed"
    chosen_for: Annotated[
        Annotated[list[Annotated[str, Text()]], Field(min_length=1)] | None,
        Field(
            alias="chosen for",
            description="Tasks to be done with the novel objects, for which observers choose what they hold.",
        ),
    ] = None
    first: Annotated[
        Annotated[str, Text()] | None,
        Field(description="Group that comes before the others in each repetition, whatever their order."),
    ] = None
    times: Annotated[int, Whole(1, 100), Field(description="Number of presentations of an object in a row.")] = 1
    gradual: GradualEntry | None = None
    do: ActionEntry
    teaches: Annotated[bool, Field(description="True if observers learn from these presentations.")] = True
    measured: Annotated[bool, Field(description="True if numbers and figures are about these presentations.")] = True
    ask_after_each: Annotated[
        bool, Field(description="True to ask for the choice before the first and after each earlier presentation.")
    ] = False

    @property
    def is_chosen(self) -> bool:
        """True if the observer chooses what to hold next."""
        return self.order == "chosen"

    @model_validator(mode="after")
    def check_chosen(self) -> Self:
        """Refuses an order that is chosen for nothing, or of what is not held, and tasks of another order."""
        if not self.is_chosen:
            if self.chosen_for is not None:
                raise complain(f"is given, must be omitted for the order {self.order!r}", "chosen for")
            return self
        tasks = self.chosen_for or []
        if not tasks:
            raise complain("is missing, must list the tasks for which observers choose what they hold", "chosen for")
        for index, task in enumerate(tasks):
            if task in tasks[:index]:
                raise complain(f"is {task!r}, which is listed before it already", f"chosen for[{index}]")
        for key, given in (("gradual", self.gradual is not None), ("times", self.times > 1)):
            if given:
                raise complain("is given, must be omitted where observers choose what they hold", key)
        if self.do.hold is None or not self.teaches:
            key = "teaches" if self.do.hold is not None else "do"
            raise complain("must be holds that teach where observers choose what they hold", key)
        return self
