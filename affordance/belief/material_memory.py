"""Memory of one observer, such as a robot arm: known colours, lifted objects, and a learner's state.

Materials are identified by colour, not by name. For example, the belief about a brass-coloured object follows from
earlier brass-coloured objects. A new colour has the broad prior. Memories are immutable, and contain their learner:
learning returns a new memory.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from affordance.arguments import Seed, check_kind, check_number, check_seed
from affordance.arrays import Array
from affordance.belief.colour_recognition import compute_colour_probabilities, find_colour_index, find_material
from affordance.belief.density_belief import (
    EMPTY_BELIEF,
    Density,
    DensityBelief,
    summarise_density,
)
from affordance.belief.felt_object import AtHand, Thing
from affordance.belief.holds import Felt
from affordance.belief.learner import Groups, Learner, Seen, State, describe_prior
from affordance.belief.learners import DENSITY, check_learner
from affordance.belief.likelihood import Likelihood
from affordance.belief.one_density import OneDensity
from affordance.belief.prior import Prior
from affordance.exceptions import BadArgumentError
from affordance.files.html_table import build_table
from affordance.objects.appearance import PartAppearance, is_same_object
from affordance.objects.colour import Colour, is_same_colour, show_colour
from affordance.objects.materials import DENSITIES, Material, MaterialLike, find_colour
from affordance.runs.random_streams import ObserverDraws

# Largest number of trials that ``remember`` adds to a state at once.
_BATCH = 10_000
_CERTAIN_SD = 1e-3  # standard deviation of a known density, [kg/m^3]


class Recollection(NamedTuple):
    """Belief about a seen object before its lift."""

    memory: "MaterialMemory"  # memory, to which new colours of the object were added
    densities: DensityBelief  # belief about the object's m densities, one per colour
    colours: tuple[int, ...]  # index of each of the m colours in the memory
    columns: tuple[int, ...]  # index of each part's density among the object's densities


class Lesson(NamedTuple):
    """Memory after a trial, with belief about and likelihood of the object's densities."""

    memory: "MaterialMemory"
    densities: DensityBelief
    likelihood: Likelihood


@dataclass(frozen=True, eq=False)
class MaterialMemory:
    """Memory of an observer. ``MaterialMemory()`` is empty and learns one density per colour.

    Attributes:
        learner: Learner of the observer.
        seed: Seed of the learner's random draws, if it makes any.
        colours: Known colours, in the order of their first appearance.
        state: State of the learner; empty if no colour is known.
        things: Lifted objects, in the order of their numbers in the state. Objects of equal appearance count as one.
        num_lifts: Number of lifts that the memory contains.
        at_hand: Object that was recalled last; None after its lift.

    Example:
        >>> from affordance import MaterialMemory
        >>> known = MaterialMemory.from_densities({"steel": 7850, "beech": 720})
        >>> round(known.density("steel").mean)
        7850
    """

    learner: Learner = DENSITY
    seed: tuple[int, ...] = (0,)
    colours: tuple[Colour, ...] = ()
    state: State = field(default_factory=dict)
    things: tuple[Thing, ...] = ()
    num_lifts: int = 0
    at_hand: AtHand | None = None

    def __post_init__(self) -> None:
        """Checks learner and seed, and makes the state read-only."""
        object.__setattr__(self, "learner", check_learner("learner", self.learner))
        object.__setattr__(self, "seed", check_seed(self.seed))
        for array in self.state.values():
            array.setflags(write=False)

    def __repr__(self) -> str:
        learner = "" if self.learner.name == "density" else f"{self.learner.name}, "
        colours = ", ".join(map(show_colour, self.colours)) or "no colour"
        return f"MaterialMemory({learner}{colours}: {self.belief.describe()})"

    def _repr_html_(self) -> str:
        low, median, high = self.belief.compute_percentiles([0.05, 0.5, 0.95]) if self.colours else np.zeros((3, 0))
        rows = [
            [show_colour(colour), f"{median[i]:.4g}", f"{low[i]:.4g} to {high[i]:.4g}"]
            for i, colour in enumerate(self.colours)
        ]
        return build_table("Memory of materials", ["colour", "median (kg/m^3)", "90 % interval"], rows)

    @classmethod
    def from_densities[M: MaterialLike](
        cls, densities: Mapping[M, float], materials: Mapping[str, Material] | None = None
    ) -> "MaterialMemory":
        """Builds the memory of an observer that knows material densities exactly.

        Args:
            densities: Density of each material, [kg/m^3]. A key is the name of a material, a Material, or a colour.
            materials: Materials by name; None uses the package's materials.

        Raises:
            BadArgumentError: A key is neither a material nor a colour, or a density is out of bounds.
        """
        if not isinstance(densities, Mapping):
            problem = f"is of type {type(densities).__name__}, must be a mapping from materials or colours to kg/m^3"
            raise BadArgumentError("densities", "", problem)
        colours = tuple(find_colour(material, materials, "densities") for material in densities)
        known = [
            check_number(f"densities[{material!r}]", value, DENSITIES.low, DENSITIES.high, "kg/m^3")
            for material, value in densities.items()
        ]
        belief = DensityBelief.from_moments(np.array(known, dtype=float), _CERTAIN_SD**2 * np.eye(len(known)))
        return cls.from_belief(colours, belief)

    @classmethod
    def from_belief(cls, colours: Sequence[Colour], belief: DensityBelief) -> "MaterialMemory":
        """Builds a memory with one density per colour from a belief about mean densities.

        Args:
            colours: Colour of each density in the belief.
            belief: Belief about the mean densities.

        Raises:
            BadArgumentError: The numbers of densities and colours differ.
        """
        check_kind("belief", belief, DensityBelief)
        if belief.size != len(colours):
            problem = f"is about {belief.size} densities, must be about {len(colours)}, one for each colour"
            raise BadArgumentError("belief", "", problem)
        if not colours:
            return cls()
        return cls()._start(tuple(colours), Prior()).set_prior(belief)

    @cached_property
    def belief(self) -> DensityBelief:
        """Belief about the mean density of new objects of each colour."""
        return DensityBelief.from_normals(self.learner.believe(self.state)) if self.state else EMPTY_BELIEF

    def density(self, material: MaterialLike, materials: Mapping[str, Material] | None = None) -> Density:
        """Returns the belief about the density of a known material, [kg/m^3].

        Args:
            material: Name of a material, a Material, or a colour.
            materials: Materials by name; None uses the package's materials.

        Raises:
            BadArgumentError: The material does not exist, or its colour is unknown to the memory.
        """
        colour = find_colour(material, materials)
        index = find_colour_index(self.colours, colour)
        if index is None:
            met = ", ".join(map(show_colour, self.colours)) or "none"
            name = repr(material) if isinstance(material, str) else show_colour(colour)
            problem = f"is {name}, but no object of its colour was met; colours met are {met}"
            raise BadArgumentError("material", "", problem)
        return summarise_density(self.belief, index)

    def add_colours(self, colours: Sequence[Colour], prior: Prior) -> "MaterialMemory":
        """Adds colours that are not known yet, with the prior of their densities."""
        new: list[Colour] = []
        for colour in colours:
            if find_colour_index([*self.colours, *new], colour) is None:
                new.append(colour)
        if not self.colours and new:
            return self._start(tuple(new), prior)
        memory = self
        for colour in new:
            certainly_new = np.append(np.zeros(len(memory.colours)), 1.0)
            memory, _ = memory._meet(colour, certainly_new, prior)
        return memory

    def recognise(
        self, colour: Colour, colour_sd: float, prior: Prior, lightness_sd: float = 0.0
    ) -> "tuple[MaterialMemory, int]":
        """Recognises a measured colour, and adds it to the memory if it is new.

        The learner decides how to treat a colour that may belong to several materials.

        Args:
            colour: Measured colour.
            colour_sd: Standard deviation of the measurement error in each direction of CIELAB; 0 if exact.
            prior: Prior of unknown materials.
            lightness_sd: Standard deviation of an additional error due to illumination, in units of L*.

        Returns:
            Memory, and index of the colour in the memory.
        """
        if colour_sd == 0.0:
            memory = self.add_colours([colour], prior)
            index = find_colour_index(memory.colours, colour)
            assert index is not None
            return memory, index
        if not self.colours:
            return self._start((colour,), prior), 0
        probabilities = compute_colour_probabilities(colour, colour_sd, self.colours, lightness_sd)
        return self._meet(colour, probabilities, prior)

    def restrict_to(self, colours: Sequence[Colour]) -> "MaterialMemory":
        """Selects known colours, in this order, and the objects that have no other colours."""
        if tuple(colours) == self.colours:
            return self
        kept = [self.colours.index(colour) for colour in colours]
        numbers = [number for number, thing in enumerate(self.things) if set(thing.colours) <= set(kept)]
        things = (self.things[number] for number in numbers)
        return replace(
            self,
            colours=tuple(colours),
            state=self.learner.select(self.state, kept, numbers) if self.state else {},
            things=tuple(thing._replace(colours=tuple(map(kept.index, thing.colours))) for thing in things),
            at_hand=None,
        )

    def recall(self, appearance: Sequence[PartAppearance], prior: Prior) -> Recollection:
        """Predicts the densities of a seen object before its lift.

        The prediction for a new object follows from other objects of its colours. For a known object, it depends on
        the learner whether earlier lifts of this object are used. The learner of the paper predicts the same density
        for all objects of a colour; it only uses the identity of objects when it updates its belief.

        Args:
            appearance: Appearance of the object, by which known objects are recognised.
            prior: Prior of unknown materials.
        """
        memory, columns = self._look_at(appearance, prior)
        assert memory.at_hand is not None
        densities = DensityBelief.from_normals(memory.learner.expect(memory.state, memory.at_hand.seen))
        return Recollection(memory, densities, memory.at_hand.thing.colours, columns)

    def _look_at(
        self, appearance: Sequence[PartAppearance], prior: Prior
    ) -> "tuple[MaterialMemory, tuple[int, ...]]":
        """Recognises a seen object, and adds its new colours to the memory.

        Returns:
            Memory with the object at hand, and index of each part's density among the object's densities.
        """
        memory, columns, parts = self, list[int](), list[PartAppearance]()
        if not memory.colours:
            memory = memory.add_colours([part.colour for part in appearance if part.colour_sd == 0.0], prior)
        for part in appearance:
            memory, column = memory.recognise(part.colour, part.colour_sd, prior, part.lightness_sd)
            columns.append(column)
            parts.append(part._replace(colour=memory.colours[column]))
        colours = tuple(dict.fromkeys(columns))
        own = set(colours)
        alike = (i for i, thing in enumerate(memory.things) if set(thing.colours) == own)
        number = next((i for i in alike if is_same_object(memory.things[i].appearance, parts)), None)
        thing = Thing(tuple(parts), colours) if number is None else memory.things[number]
        at_hand = AtHand(thing, len(memory.things) if number is None else number)
        memory = replace(memory, state={**memory.state, **describe_prior(prior, 1)}, at_hand=at_hand)
        return memory, tuple(map(thing.colours.index, columns))

    def remember(
        self,
        lifts: Iterable[tuple[Sequence[PartAppearance], Callable[[Seen, Sequence[int]], Felt]]],
        prior: Prior,
    ) -> "MaterialMemory":
        """Adds many trials, and computes the belief once at the end.

        The result is the same as after sequential learning. The learner must have one density per colour.

        Args:
            lifts: Appearance of the object in each trial, and a function that returns the measurements. Its arguments
                are the object, and the index of each part's density among the object's densities.
            prior: Prior of unknown materials.
        """
        memory, learner = self, self.learner
        assert isinstance(learner, OneDensity)
        known: dict[object, tuple[AtHand, tuple[int, ...]]] = {}
        added: list[tuple[Seen, Felt]] = []

        def settle() -> MaterialMemory:
            settled = replace(memory, state=learner.add_many(memory.state, added)) if added else memory
            added.clear()
            return settled

        for appearance, describe in lifts:
            looks = tuple(appearance)
            if (looks, len(memory.colours)) not in known:
                # If a new colour may be a known material, its prior depends on all earlier trials.
                if any(find_material(part, memory.colours) is None for part in looks):
                    memory = settle()
                memory, columns = memory._look_at(looks, prior)
                at_hand = memory.at_hand
                assert at_hand is not None
                if at_hand.number == len(memory.things):
                    memory = replace(memory, things=(*memory.things, at_hand.thing))
                known[looks, len(memory.colours)] = at_hand, columns
            at_hand, columns = known[looks, len(memory.colours)]
            added.append((at_hand.seen, describe(at_hand.seen, columns)))
            memory = replace(memory, num_lifts=memory.num_lifts + 1, at_hand=None)
            if len(added) == _BATCH:
                memory = settle()
        memory = settle()
        return replace(memory, state=learner.infer(memory.state)[0]) if memory.state else memory

    def learn(self, felt: Felt, deviation: float) -> Lesson:
        """Updates the memory after a lift of the object that was recalled last.

        Args:
            felt: Measurements of the lift.
            deviation: SD of object densities within a material, as a fraction of the mean density.

        Raises:
            ValueError: No object was recalled since the last lift.
        """
        at_hand = self.at_hand
        if at_hand is None:
            raise ValueError("no object was recalled since the last lift; recall one before learning from it")

        rng = ObserverDraws([(*self.seed, self.num_lifts + 1)])
        state = {**self.state, "deviation": np.full(1, deviation)}
        lesson = self.learner.learn(state, at_hand.seen, felt, rng)
        things = self.things if at_hand.number < len(self.things) else (*self.things, at_hand.thing)
        memory = replace(self, state=lesson.state, things=things, num_lifts=self.num_lifts + 1, at_hand=None)
        return Lesson(memory, DensityBelief.from_normals(lesson.densities), lesson.likelihood.take(0))

    def set_prior(self, belief: DensityBelief) -> "MaterialMemory":
        """Replaces the prior of the M colours and updates the belief; needs a learner with one density per colour."""
        assert isinstance(self.learner, OneDensity)
        state = self.learner.set_prior(self.state, belief.precision[None], belief.information_vector[None])
        return replace(self, state=state)

    @property
    def prior(self) -> DensityBelief:
        """Prior of the M colours. The learner must have one density per colour."""
        return DensityBelief(self.state["precision"][0], self.state["information"][0])

    def group(self) -> Groups:
        """Returns the groups of objects with a common mean density. The memory must have a colour."""
        return self.learner.group(self.state)

    def find_kind(self, appearance: Sequence[PartAppearance]) -> int:
        """Returns the number of an object's kind among the kinds of its first part's colour.

        Kinds are numbered from 1, the oldest first. The number is 0 if the object was never lifted or the learner has
        no kinds.
        """
        number = next((i for i, each in enumerate(self.things) if is_same_object(each.appearance, appearance)), None)
        if number is None or (groups := self.group()).counts is None:
            return 0
        thing = self.things[number]
        kinds = self.learner.find_groups(self.state, AtHand(thing, number).seen)[0]
        for colour, kind in zip(thing.colours, kinds, strict=True):
            if is_same_colour(self.colours[colour], appearance[0].colour):
                return 1 + int((groups.colours[0, :kind] == colour).sum())
        return 0

    def _start(self, colours: tuple[Colour, ...], prior: Prior) -> "MaterialMemory":
        rng = ObserverDraws([(*self.seed, 0)])
        state = self.learner.start(rng, self.learner.parameters, prior, len(colours), 1)
        return replace(self, colours=colours, state={**state, **describe_prior(prior, 1)})

    def _meet(self, colour: Colour, probabilities: Array, prior: Prior) -> "tuple[MaterialMemory, int]":
        """Recognises or adds a colour, given the probabilities of each known colour and, last, of a new colour."""
        state, index = self.learner.meet({**self.state, **describe_prior(prior, 1)}, probabilities)
        if index < len(self.colours):
            return self, index
        return replace(self, colours=(*self.colours, colour), state=state), index


def start_memory(learner: Learner | str = "density", seed: Seed = 0) -> MaterialMemory:
    """Builds the memory of an observer without experience.

    Args:
        learner: Learner, or its name.
        seed: Seed of the learner's random draws, if it makes any. Different observers need different seeds.

    Raises:
        BadArgumentError: The learner does not exist, or the seed is invalid.
    """
    return MaterialMemory(check_learner("learner", learner), check_seed(seed))
