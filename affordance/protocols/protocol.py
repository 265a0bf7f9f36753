"""Protocol of an experiment as one file: objects, observers, presentations, numbers and claims."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from affordance.belief.learner import Learner
from affordance.exceptions import BadValueError, describe_choice, show_value
from affordance.files.bounded import read_yaml
from affordance.files.constraints import FileName, OneOf, Text, Whole, Within, complain
from affordance.files.data_model import DataModel, check_content, join_key
from affordance.files.model_folder import MODELS, list_studies
from affordance.protocols import ALL
from affordance.protocols.block_entries import BlockEntry
from affordance.protocols.number_entries import FigureEntry, NumberEntry
from affordance.protocols.object_entries import ObjectsEntry
from affordance.protocols.report_entries import ReportEntry
from affordance.reporting.section import PlainReport

# Folder of the program's protocols in the folder of models.
FOLDER = "protocols"
# Folders of results that belong neither to a protocol nor to a study of the same name.
TAKEN = ("experience", "frames", "arms", "ours", "vision", "kappa", "benchmarks", "agreement", "vision_comparison")
# Suffixes of protocol files.
SUFFIXES = (".yaml", ".yml")
# Name of the objects that are chosen about and not held, in addition to the groups.
NOVEL = "novel"

# Files that a run writes next to the figures of a protocol.
_FILES = ("diagram", "replay", "seen", "trajectories")

# Beginnings of templates.
_MARKS = ("{{", "{%", "{#")


def _check_name(name: str) -> str:
    if not name.replace("_", "").isalnum() or not name.isascii() or name != name.lower():
        raise complain(f"is {name!r}, must be of small letters, digits and underscores: it names a folder")
    return FileName().check(name)


def _check_figure(name: str) -> str:
    if name in _FILES:
        raise complain(f"is {name!r}, must be another: results have a file of that name already")
    return name


type FigureName = Annotated[str, FileName(), AfterValidator(_check_figure)]


class NoiseEntry(DataModel):
    """Errors of measured joint torques."""

    weber_fraction: Annotated[float, Within(0.0, 1.0), Field(description="Error as a share of the torque.")]
    # Not zero: a joint without load would measure its torque without error.
    threshold: Annotated[float, Within(1e-6, 10.0), Field(description="Absolute threshold of the error, [N m].")]


class ObserversEntry(DataModel):
    """Simulated observers."""

    number: Annotated[int, Whole(1, 1_000_000), Field(description="Number of observers of each learner.")] = 200
    learners: Annotated[
        Annotated[list[Annotated[Learner, OneOf(Learner)]], Field(min_length=1)] | None,
        Field(description="Learners, each of which is simulated; that of the command line if left out."),
    ] = None
    told: Annotated[
        list[Annotated[str, Text()]], Field(description="Materials whose densities they know beforehand.")
    ] = Field(default_factory=list)
    vision: Annotated[
        Literal["features", "pixels"] | None,
        Field(description="Source of features; that of the command line if left out."),
    ] = None
    noise: Annotated[
        NoiseEntry | None, Field(description="Errors of measured torques; those of all simulations if left out.")
    ] = None
    arm: Annotated[
        Annotated[str, Text()] | None, Field(description="Model directives of the arm; the models' arm if left out.")
    ] = None

    @model_validator(mode="after")
    def check_learners(self) -> Self:
        """Refuses a learner that is named twice."""
        learners = self.learners or []
        for index, learner in enumerate(learners):
            if learner in learners[:index]:
                raise complain(f"is {learner.value!r}, which is listed before it already", f"learners[{index}]")
        return self


class Protocol(DataModel):
    """Protocol of an experiment, as a file."""

    name: Annotated[str, Text(), AfterValidator(_check_name), Field(description="Name of the folder of results.")]
    question: Annotated[str, Text(), Field(description="Question of the protocol, in a sentence or two.")]
    objects: ObjectsEntry
    novel: Annotated[ObjectsEntry | None, Field(description="Objects that are chosen about and never held.")] = None
    observers: ObserversEntry = Field(default_factory=ObserversEntry)
    settings: Annotated[
        dict[str, Any],
        Field(
            description="Settings that are not as they are by default, by name, as `affordance settings` lists them."
        ),
    ] = Field(default_factory=dict)
    blocks: Annotated[
        list[BlockEntry], Field(min_length=1, max_length=100, description="Blocks of presentations, in order.")
    ]
    numbers: Annotated[dict[str, NumberEntry], Field(description="Numbers of metrics.json.")] = Field(
        default_factory=dict
    )
    figures: Annotated[dict[FigureName, FigureEntry], Field(description="Figures by the names of their files.")] = (
        Field(default_factory=dict)
    )
    published: Annotated[
        Annotated[str, Text()] | None,
        Field(description="Table of what people did: a row a number, with its interval and source."),
    ] = None
    people: Annotated[
        Annotated[str, Text()] | None,
        Field(description="Table of what people did lift by lift, in the columns of the lifts.csv of a run."),
    ] = None
    report: ReportEntry = Field(default_factory=ReportEntry)

    @model_validator(mode="after")
    def check_names(self) -> Self:
        """Refuses unknown groups, and blocks that contradict each other."""
        groups = [ALL, *self.objects.groups]
        for key, group in self._list_groups():
            known = [*groups, NOVEL] if self.novel is not None and key.startswith("blocks") else groups
            if group not in known:
                raise complain(describe_choice(group, known), key)
        names = [block.name for block in self.blocks]
        for index, block in enumerate(self.blocks):
            if block.name in names[:index]:
                raise complain(f"is {block.name!r}, the name of an earlier block", f"blocks[{index}].name")
            if block.ask_after_each and (block.do.choose is None or index == 0):
                problem = "is true, must be false but of a choice with a block before it"
                raise complain(problem, f"blocks[{index}].ask_after_each")
            if (block.objects == NOVEL) != (block.do.choose is not None):
                problem = f"is {block.objects!r}, must be {NOVEL!r} of a choice, and of nothing else"
                raise complain(problem, f"blocks[{index}].objects")
        self._check_choices()
        closed = [block.do.clamp is not None and block.do.clamp.closed_form for block in self.blocks]
        for index, block in enumerate(self.blocks):
            if any(closed) and not (closed[index] or block.do.look is not None):
                problem = "is simulated, must be a clamp in closed form or a look as other blocks are in closed form"
                raise complain(problem, f"blocks[{index}].do")
        return self

    @property
    def has_choices(self) -> bool:
        """True if observers choose a grip; the numbers are then those of Simulations III and IV."""
        return any(block.do.choose is not None for block in self.blocks)

    def _check_choices(self) -> None:
        """Refuses keys without effect on choices, and keys without effect in the absence of choices."""
        chosen = [index for index, block in enumerate(self.blocks) if block.is_chosen]
        if chosen and self.novel is None:
            problem = "is missing, must list the objects whose tasks decide what is held"
            raise complain(f"{problem} in blocks[{chosen[0]}]", "novel")
        if not self.has_choices:
            if self.novel is not None and not chosen:
                raise complain("is given, must be omitted without a block that chooses about these objects", "novel")
            if not any(block.measured for block in self.blocks):
                raise complain("has no block that is measured, must have at least one", "blocks")
            return
        for key in ("numbers", "figures", "published", "people"):
            if getattr(self, key):
                problem = (
                    "is given, must be omitted for choices, whose numbers and figures are those of Simulation III"
                )
                raise complain(problem, key)
        for index, block in enumerate(self.blocks):
            ignored = block.model_fields_set & {"repetitions", "order", "first", "times", "gradual"}
            if block.do.choose is not None and ignored:
                problem = "is given, must be omitted for a choice, on which it has no effect"
                raise complain(problem, f"blocks[{index}].{min(ignored)}")

    @property
    def is_closed_form(self) -> bool:
        """True if nothing is simulated and lifts are computed in closed form."""
        return any(block.do.clamp is not None and block.do.clamp.closed_form for block in self.blocks)

    def build_report(self, path: Path) -> PlainReport:
        """Builds the report of the protocol that was read from a file."""
        return self.report.build(path, self.name, self.question, numbers=self.numbers, figures=self.figures)

    def _list_groups(self) -> Iterator[tuple[str, str]]:
        """Yields every group that is named, with its key."""
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
    """Reads a protocol from a file; raises a BadValueError with its first fault."""
    content = read_yaml(path)
    refuse_templates(path, content)
    return check_content(path, "", content, Protocol)


def refuse_templates(path: Path, content: Any) -> None:
    """Raises a BadValueError for a parsed file in which a text or a name contains the beginning of a template."""
    waiting: list[tuple[tuple[int | str, ...], Any]] = [((), content)]
    while waiting:
        place, value = waiting.pop()
        if isinstance(value, Mapping):
            waiting += [((*place, str(key)), each) for key, each in value.items()]
            waiting += [((*place, str(key)), key) for key in value]
        elif isinstance(value, list):
            waiting += [((*place, index), each) for index, each in enumerate(value)]
        elif isinstance(value, str) and (found := [mark for mark in _MARKS if mark in value]):
            problem = (
                f"is {show_value(value)}, must be plain text without {found[0]!r}: nothing is filled in; the report "
                "shows every number in a table of its own, and a claim compares numbers by an expression"
            )
            raise BadValueError(path, join_key(place), problem)


def find_number_of_observers(name: str, models: Path = MODELS) -> int | None:
    """Returns the number of observers of a protocol, by its name or path; None if it gives none."""
    observers = load_protocol(find_protocol(name, models)).observers
    return observers.number if "number" in observers.model_fields_set else None


def check_folder_is_free(name: str, path: Path, models: Path = MODELS) -> None:
    """Raises a BadValueError for a user's protocol called like one of the program, or like a study."""
    shipped = {(folder / FOLDER / f"{name}.yaml").resolve() for folder in (models, MODELS)}
    if path.resolve() in shipped:
        return
    is_taken = name in (*TAKEN, *list_studies())
    if is_taken or name in {*list_shipped(models), *list_shipped(MODELS)}:
        owner = "other results of the program" if is_taken else f"the protocol {name} that comes with the program"
        raise BadValueError(path, "name", f"is {name!r}, must be another: results/{name} is of {owner}")


def list_shipped(models: Path = MODELS) -> list[str]:
    """Lists the names of the protocols in a folder of models."""
    return sorted(path.stem for path in (models / FOLDER).glob("*.yaml"))


def find_protocol(name: str, models: Path = MODELS) -> Path:
    """Finds the file of a protocol by its path or, for one of the program's, its name; else a BadValueError."""
    path = Path(name)
    if path.suffix in SUFFIXES:
        return path
    for folder in (models, MODELS):
        if name in list_shipped(folder):
            return folder / FOLDER / f"{name}.yaml"
    raise BadValueError("protocol", "", f"{describe_choice(name, list_shipped(MODELS))}; or the path of a .yaml file")
