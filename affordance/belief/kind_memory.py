"""Memory of a learner with kinds, which distinguishes odd members of a material from objects of another kind.

Before a lift, the belief about an object that was lifted before is the density of its kind, or its own; about a new
object it is that of the most populous kind of its colour. After a lift the gate (``kinds_gate``) computes the
probabilities of the kinds of the object, the most probable hypothesis or a random one is adopted, and its kinds are
updated by Bayes' rule.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from affordance.arguments import Seed, check_member, check_seed
from affordance.belief.colour_recognition import compute_colour_probabilities, find_colour_index
from affordance.belief.density_belief import DensityBelief, FindLikelihood, Prior
from affordance.belief.kinds import (
    NO_KINDS,
    KindPrior,
    Kinds,
    KnownObject,
    Membership,
    OwnDensities,
    assign,
    restrict_colours,
    teach,
    tidy,
)
from affordance.belief.kinds_gate import (
    GateSettings,
    KindSettings,
    Verdict,
    find_stable,
    list_hypotheses,
    predict_densities,
    start_kinds,
    weigh,
)
from affordance.belief.learner import Learner, Pick
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import FeltObject, Lesson, Memory, Recollection, tabulate_densities
from affordance.objects.appearance import PartAppearance, is_same_object
from affordance.objects.colour import Colour, is_same_colour

# Breadth of a category over its mean density, fitted to two groups of people, once for each way to pick: 0.214, 95 %
# interval 0.171 to 0.244, and 0.225, 0.185 to 0.272 (`affordance study people`; docs/decisions/0026-kinds.md).
KAPPA = {Pick.MAP: 0.21, Pick.DRAWN: 0.22}
# The default for a working arm: an odd object does not spoil the belief about its material, and without odd objects
# it behaves as a learner with one density for each colour (docs/decisions/0026-kinds.md).
ARM_LEARNER = Learner.KINDS_MAP


class ObjectAtHand(NamedTuple):
    """Object that was recalled last, its index among the objects (None if it was never lifted), and the prior."""

    known: KnownObject
    place: int | None
    prior: Prior


@dataclass(frozen=True)
class KindMemory(Memory):
    """Memory of kinds and objects.

    Attributes:
        settings: Settings of the learner.
        colours: Known colours, in the order they were met.
        kinds: Kinds, with the objects of each.
        num_lifts: Number of lifts from which it has learned.
        at_hand: Object that was recalled last, until its lift is learned from.
    """

    settings: KindSettings
    colours: tuple[Colour, ...] = ()
    kinds: Kinds = NO_KINDS
    num_lifts: int = 0
    at_hand: ObjectAtHand | None = None

    def __repr__(self) -> str:
        counts = f"{len(self.kinds.colours)} kinds of {len(self.colours)} colours, {len(self.kinds.objects)} objects"
        return f"KindMemory({counts} in {self.num_lifts} lifts: {self.belief.describe()})"

    def _repr_html_(self) -> str:
        return tabulate_densities("Memory of materials, most populous kinds", self)

    @cached_property
    def belief(self) -> DensityBelief:
        """Belief about a new object of each colour, which is that about the colour's most populous kind."""
        kinds = [self.kinds.find_most_populous(colour) for colour in range(len(self.colours))]
        return self.kinds.belief.select(kinds)

    def find(self, appearance: Sequence[PartAppearance]) -> int | None:
        """Returns the index of the object of an appearance; None if it was never lifted."""
        objects = enumerate(self.kinds.objects)
        return next((index for index, known in objects if is_same_object(known.appearance, appearance)), None)

    def add_colours(self, colours: Sequence[Colour], prior: Prior) -> "KindMemory":
        """Returns the memory with a kind for each new colour, which starts with the prior."""
        memory = self
        for colour in colours:
            if find_colour_index(memory.colours, colour) is None:
                first = KindPrior(prior.mode, prior.sd)
                kinds = memory.kinds.add((len(memory.colours),), [first])
                memory = replace(memory, colours=(*memory.colours, colour), kinds=kinds)
        return memory

    def recognise(
        self, colour: Colour, colour_sd: float, prior: Prior, lightness_sd: float = 0.0
    ) -> "tuple[KindMemory, int]":
        """Finds or adds a measured colour; with a measurement error the most probable one. See ``Memory``."""
        if colour_sd > 0.0:
            best = int(compute_colour_probabilities(colour, colour_sd, self.colours, lightness_sd).argmax())
            if best < len(self.colours):
                return self, best
        memory = self.add_colours([colour], prior)
        index = find_colour_index(memory.colours, colour)
        assert index is not None
        return memory, index

    def recall(self, appearance: Sequence[PartAppearance], prior: Prior) -> "Recollection[KindMemory]":
        """Recalls the belief about this object or, if it was never lifted, about new objects of its colours.

        The cost is a comparison with every object, and O(K^3) for K kinds; see ``Memory``.
        """
        memory, parts = self, []
        for part in appearance:
            memory, colour = memory.recognise(part.colour, part.colour_sd, prior, part.lightness_sd)
            parts.append(part._replace(colour=memory.colours[colour]))
        place = memory.find(parts)
        colours = tuple(dict.fromkeys(memory.colours.index(part.colour) for part in parts))
        if place is None:
            memberships = tuple(Membership(memory.kinds.find_most_populous(colour), 0, 1.0) for colour in colours)
            known = KnownObject(tuple(parts), colours, memberships)
        else:
            known = memory.kinds.objects[place]
            colours = known.colours
        chosen = tuple(membership.kind for membership in known.memberships)
        scatter_sd = np.full(len(memory.kinds.colours), prior.deviation_sd)
        densities = predict_densities(memory.kinds, chosen, scatter_sd, find_stable(known, chosen))
        columns = tuple(colours.index(memory.colours.index(part.colour)) for part in parts)
        shown = tuple(memory.colours[colour] for colour in colours)
        felt = FeltObject.of(shown, known.felt, prior, known.appearance)
        return Recollection(replace(memory, at_hand=ObjectAtHand(known, place, prior)), densities, columns, felt)

    def weigh(self, find_likelihood: FindLikelihood) -> list[Verdict]:
        """Weighs all hypotheses about the kinds of the object recalled last; the last of each colour is new."""
        known, place, prior = self._get_at_hand()
        gate = self.settings.gate
        new = [self.kinds.predict_new(colour, prior, gate.spread) for colour in known.colours]
        kinds = self.kinds.add(known.colours, new)
        return weigh(list_hypotheses(kinds, known, place, gate), find_likelihood, gate)

    def learn(
        self, densities: DensityBelief, find_likelihood: FindLikelihood, deviation_sd: float
    ) -> "Lesson[KindMemory]":
        """Infers the kinds of the object recalled last, and learns from the lift; see ``Memory``.

        The cost is a weighing of all hypotheses (``kinds_gate``) and O(K^3) for K kinds, for any number of lifts.
        Without a recalled object a ValueError is raised.
        """
        verdicts = self.weigh(find_likelihood)
        chosen = self.settings.pick_verdict(verdicts, self.num_lifts + 1)
        return self.take(verdicts, chosen, find_likelihood, deviation_sd)

    def take(
        self, verdicts: list[Verdict], chosen: Verdict, find_likelihood: FindLikelihood, deviation_sd: float
    ) -> "Lesson[KindMemory]":
        """Adopts one of the verdicts from ``weigh`` about the object recalled last, and learns from the lift."""
        known, place, prior = self._get_at_hand()
        chosen = start_kinds(chosen, find_likelihood, self.settings.gate.spread)
        taken = chosen.hypothesis.kinds
        first_new = len(self.kinds.colours)
        new_columns = [column for column, kind in enumerate(taken) if kind >= first_new]
        starts = [self._start_kind(chosen, column) for column in new_columns]
        kinds = self.kinds.add(tuple(known.colours[column] for column in new_columns), starts)
        numbers = {taken[column]: first_new + i for i, column in enumerate(new_columns)}
        named = [numbers.get(kind, kind) for kind in taken]
        stays = place is not None and all(
            before.kind == kind for before, kind in zip(known.memberships, named, strict=True)
        )
        earlier = known.felt if stays else None  # the deviation from other kinds is another
        kinds = replace(kinds, belief=teach(kinds.belief, named, chosen.likelihood, deviation_sd, earlier))
        probabilities = [
            sum(verdict.probability for verdict in verdicts if verdict.hypothesis.kinds[column] == kind)
            for column, kind in enumerate(taken)
        ]
        felt = chosen.likelihood if earlier is None else chosen.likelihood.add(earlier)
        lifted = known._replace(own=OwnDensities(tuple(range(len(taken))), chosen.posterior), felt=felt)
        kinds = tidy(assign(kinds, lifted, place, list(zip(named, probabilities, strict=True))), prior)
        memory = replace(self, kinds=kinds, num_lifts=self.num_lifts + 1, at_hand=None)
        return Lesson(memory, chosen.posterior, chosen.likelihood)

    def restrict_to(self, colours: Sequence[Colour]) -> "KindMemory":
        """Returns the memory of these known colours only, with the objects that have no other colour."""
        if tuple(colours) == self.colours:
            return self
        numbers = {self.colours.index(colour): new for new, colour in enumerate(colours)}
        return replace(self, colours=tuple(colours), kinds=restrict_colours(self.kinds, numbers), at_hand=None)

    def _start_kind(self, chosen: Verdict, column: int) -> KindPrior:
        """Returns the prior of a new kind: the density that its hypothesis predicts for its first object."""
        known, _, prior = self._get_at_hand()
        hypothesis = chosen.hypothesis
        if column not in hypothesis.founded:
            return self.kinds.predict_new(known.colours[column], prior, self.settings.gate.spread)
        variance = hypothesis.densities.covariance[column, column]
        return KindPrior(float(hypothesis.densities.untruncated_mean[column]), float(np.sqrt(variance)))

    def _get_at_hand(self) -> ObjectAtHand:
        if self.at_hand is None:
            raise ValueError("no object was recalled since the last lift, must recall one before learning from it")
        return self.at_hand


def start_memory(learner: Learner | str = Learner.DENSITY, seed: Seed = 0, kappa: float | None = None) -> Memory:
    """Builds the memory of an observer without experience.

    Args:
        learner: Learner, or its name.
        seed: Seed of the random choices of a learner that draws, different for each observer.
        kappa: Breadth of a category over its mean density; None for the fitted one.

    Raises:
        BadArgumentError: The learner does not exist, the seed is invalid, or kappa is not positive.
    """
    pick, seed = check_member("learner", learner, Learner).pick, check_seed(seed)
    if pick is None:
        return MaterialMemory()
    return KindMemory(KindSettings(GateSettings(KAPPA[pick] if kappa is None else kappa), pick, seed))


def count_kinds(memory: Memory) -> int:
    """Counts the kinds that have objects; zero for a learner without kinds."""
    return int((memory.kinds.count_objects() > 0).sum()) if isinstance(memory, KindMemory) else 0


def find_kind(memory: Memory, appearance: Sequence[PartAppearance]) -> int:
    """Finds the number of an object's kind in the colour of its first part, 1 for the oldest; 0 if unknown."""
    if not isinstance(memory, KindMemory):
        return 0
    place = memory.find(appearance)
    if place is None:
        return 0
    known = memory.kinds.objects[place]
    for colour, membership in zip(known.colours, known.memberships, strict=True):
        if is_same_colour(memory.colours[colour], appearance[0].colour):
            return 1 + memory.kinds.list_of(colour).index(membership.kind)
    return 0
