"""A protocol: what is presented to whom, what is measured, and what is claimed of it, as one file."""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from affordance.belief.learner import Learner
from affordance.exceptions import BadValueError, describe_choice
from affordance.files.data_model import DataModel, OneOf, Text, Whole, Within, complain, load_model
from affordance.files.model_folder import MODELS
from affordance.protocols.block_entries import BlockEntry
from affordance.protocols.number_entries import FigureEntry, NumberEntry
from affordance.protocols.object_entries import ALL, ObjectsEntry
from affordance.protocols.report_entries import ReportEntry

# Where the protocols are that come with the program, in the folder of models.
FOLDER = "protocols"
# How files of protocols end.
SUFFIXES = (".yaml", ".yml")
# The objects that are chosen about and not held, beside the groups.
NOVEL = "novel"


def _check_name(name: str) -> str:
    if not name.replace("_", "").isalnum() or not name.isascii() or name != name.lower():
        raise complain(f"is {name!r}, must be of small letters, digits and underscores: it names a folder")
    return name


class NoiseEntry(DataModel):
    """How well joints feel torque."""

    weber_fraction: Annotated[float, Within(0.0, 1.0)]
    threshold: Annotated[float, Within(0.0, 10.0), Field(description="[N m]")]


class ObserversEntry(DataModel):
    """Who is simulated."""

    number: Annotated[int, Whole(1, 1_000_000)] = 200
    learners: Annotated[
        Annotated[list[Annotated[Learner, OneOf(Learner)]], Field(min_length=1)] | None,
        Field(description="What they learn by; each is simulated. Else as the command line says."),
    ] = None
    told: Annotated[
        list[Annotated[str, Text()]], Field(description="Materials whose densities they are told beforehand.")
    ] = Field(default_factory=list)
    vision: Annotated[
        Literal["features", "pixels"] | None, Field(description="How they see; else as the command line says.")
    ] = None
    noise: Annotated[NoiseEntry | None, Field(description="Else that of all simulations.")] = None
    arm: Annotated[Annotated[str, Text()] | None, Field(description="Model directives, else the models' arm.")] = None


class Protocol(DataModel):
    """An experiment as a file."""

    name: Annotated[str, Text(), AfterValidator(_check_name), Field(description="Of its folder of results.")]
    question: Annotated[str, Text(), Field(description="What it asks, in a sentence or two.")]
    objects: ObjectsEntry
    novel: Annotated[ObjectsEntry | None, Field(description="Objects that are chosen about and never held.")] = None
    observers: ObserversEntry = Field(default_factory=ObserversEntry)
    settings: Annotated[
        dict[str, Any],
        Field(
            description="Settings that are not as they are by default, by name, as `affordance settings` lists them."
        ),
    ] = Field(default_factory=dict)
    blocks: Annotated[list[BlockEntry], Field(min_length=1, description="In order.")]
    numbers: Annotated[dict[str, NumberEntry], Field(description="Those of metrics.json.")] = Field(
        default_factory=dict
    )
    figures: Annotated[dict[str, FigureEntry], Field(description="By the names of their files.")] = Field(
        default_factory=dict
    )
    published: Annotated[
        Annotated[str, Text()] | None,
        Field(description="Table of what people did: a row a number, with its interval and source."),
    ] = None
    report: ReportEntry

    @model_validator(mode="after")
    def check_names(self) -> Self:
        """Refuses groups, objects and blocks that there are not.

        Raises:
            PydanticCustomError: There is one.
        """
        groups = [ALL, *self.objects.groups]
        for key, group in self._list_groups():
            known = [*groups, NOVEL] if self.novel is not None and key.startswith("blocks") else groups
            if group not in known:
                raise complain(describe_choice(group, known), key)
        names = [block.name for block in self.blocks]
        for index, block in enumerate(self.blocks):
            if block.name in names[:index]:
                raise complain(
                    f"is {block.name!r}, which an earlier block is called already", f"blocks[{index}].name"
                )
            if block.ask_after_each and (block.do.choose is None or index == 0):
                problem = "is true, must be false but of a choice with a block before it"
                raise complain(problem, f"blocks[{index}].ask_after_each")
            if (block.objects == NOVEL) != (block.do.choose is not None):
                problem = f"is {block.objects!r}, must be {NOVEL!r} of a choice, and of nothing else"
                raise complain(problem, f"blocks[{index}].objects")
        closed = [block.do.clamp is not None and block.do.clamp.closed_form for block in self.blocks]
        for index, block in enumerate(self.blocks):
            if any(closed) and not (closed[index] or block.do.look is not None):
                problem = "is simulated, must be a clamp in closed form or a look as other blocks are in closed form"
                raise complain(problem, f"blocks[{index}].do")
        return self

    @property
    def is_closed_form(self) -> bool:
        """Whether nothing is simulated: its lifts are in closed form."""
        return any(block.do.clamp is not None and block.do.clamp.closed_form for block in self.blocks)

    def _list_groups(self) -> Iterator[tuple[str, str]]:
        """Every group that is named, with the key where it stands."""
        for index, block in enumerate(self.blocks):
            yield f"blocks[{index}].objects", block.objects
            if block.first is not None:
                yield f"blocks[{index}].first", block.first
        for name, number in self.numbers.items():
            yield f"numbers.{name}.of", number.of
            if number.predicted_for is not None:
                yield f"numbers.{name}.predicted_for", number.predicted_for
        for name, figure in self.figures.items():
            for key in ("of", "decoy", "predicted_from"):
                group = getattr(figure, key)
                if group is not None:
                    yield f"figures.{name}.{key}", group


def load_protocol(path: Path) -> Protocol:
    """Reads a protocol.

    Raises:
        BadValueError: The file or one of its values is wrong; the message says which and how.
    """
    return load_model(path, Protocol)


def list_shipped(models: Path = MODELS) -> list[str]:
    """Names of the protocols that come with a folder of models."""
    return sorted(path.stem for path in (models / FOLDER).glob("*.yaml"))


def find_protocol(name: str, models: Path = MODELS) -> Path:
    """The file of a protocol, given by its path or, if it comes with the models, by its name.

    Raises:
        BadValueError: There is none.
    """
    path = Path(name)
    if path.suffix in SUFFIXES:
        return path
    for folder in (models, MODELS):
        if name in list_shipped(folder):
            return folder / FOLDER / f"{name}.yaml"
    raise BadValueError("protocol", "", f"{describe_choice(name, list_shipped(MODELS))}; or the path of a .yaml file")
