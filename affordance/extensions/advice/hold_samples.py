"""Samples of the belief before something is held, allowing for one odd object.

An object can look like one material and be made of another (a decoy). Before anything is felt, each object that was
held is odd with probability ``ODD``. An odd object tells nothing about its apparent materials: the belief about them
comes from the other objects, and the odd object's own densities have the prior of any material. The hypotheses, each
with at most one odd object, are weighted by their evidence: a single object of a material cannot contradict itself;
of two that differ, either may be the odd one; a third one decides. A learner with kinds judges oddness itself; there,
the only member of a kind may be odd.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.colour_recognition import find_colour_index
from affordance.belief.density_belief import EMPTY_BELIEF, DensityBelief
from affordance.belief.felt_object import FeltObject
from affordance.belief.learner import Groups
from affordance.belief.likelihood import Likelihood
from affordance.belief.material_memory import MaterialMemory
from affordance.exceptions import BadArgumentError
from affordance.objects.colour import Colour
from affordance.objects.inertia import Geometry, build_transform_map
from affordance.settings import Settings
from affordance.vision.features import ComponentFeatures
from affordance.vision.prediction import measure_geometry

# Prior probability that an object is odd. Its value hardly matters if two objects differ by many standard deviations,
# and certainty that rests on a single object is checked for any value.
ODD = 0.01
# Largest log odds, so that sums of odds stay finite.
_MOST_LOG_ODDS = 500.0


class Suspicion(NamedTuple):
    """Hypothesis that one object is odd."""

    name: str
    columns: tuple[int, ...]  # columns of its materials
    belief: DensityBelief  # belief about materials without this object
    weight: float  # odds of the hypothesis against the hypothesis that no object is odd
    # Likelihood of the mean densities that the object contributed to the belief; None for a learner with kinds.
    shared: Likelihood | None = None

    def leave_out(self, belief: DensityBelief) -> DensityBelief | None:
        """Removes the object's contribution from a belief; None if the contribution is unknown."""
        return None if self.shared is None else _leave_out(belief, self.columns, self.shared)


class HoldSamples:
    """Samples of materials' mean densities, and of objects' own densities around them."""

    def __init__(
        self,
        memory: MaterialMemory,
        objects: Mapping[str, Sequence[ComponentFeatures]],
        felt: Mapping[str, FeltObject],
        settings: Settings,
        rng: np.random.Generator,
    ) -> None:
        """Recognises all objects, given by their parts, and the evidence about those that were held, by name."""
        prior = settings.prior
        self._objects, self._felt, self._prior, self._rng = objects, felt, prior, rng
        for parts in objects.values():
            memory = memory.recall([part.appearance for part in parts], prior).memory
        self._memory = memory
        self._columns: dict[str, list[int]] = {}
        self._colours: dict[str, list[Colour]] = {}
        for name, parts in objects.items():
            self._columns[name], self._colours[name] = self._recognise(parts)
        groups = memory.group()
        self._belief = DensityBelief.from_moments(groups.means.mean[0], groups.means.covariance[0])
        # Columns of the belief that apply to new objects: all except minor kinds of a colour. Below them, the
        # hypotheses that one of the objects held is odd.
        self.common: list[int] = groups.common[0].tolist()
        self.suspicions: list[Suspicion] = []
        if groups.counts is not None:
            self.suspicions = self._suspect_members(memory.colours, groups)
        elif memory.learner.sums_evidence:
            self.suspicions = self._suspect_objects()
        self._own: dict[str, Array] = {}
        self._errors: dict[str, Array] = {}
        # Samples of the mean densities, (S, M), of each colour or, for a learner with kinds, of each kind.
        self.mu = np.zeros((0, self._belief.size))

    def draw(self, num_samples: int, suspicion: Suspicion | None = None) -> "HoldSamples":
        """Draws samples from all hypotheses in proportion to their probability, and returns itself.

        If a suspicion is given, its object's evidence is left out.
        """
        self._own, self._errors = {}, {}
        beliefs = [self._belief, *(each.belief for each in self.suspicions)]
        weights = np.array([1.0, *(each.weight for each in self.suspicions)])
        if suspicion is not None:
            names = ["", *(each.name for each in self.suspicions)]
            beliefs = [
                belief if name == suspicion.name else suspicion.leave_out(belief) or suspicion.belief
                for name, belief in zip(names, beliefs, strict=True)
            ]
        if len(beliefs) == 1:
            self.mu = beliefs[0].draw_samples(self._rng, num_samples, is_even=True)
            return self
        chosen = self._rng.choice(len(beliefs), size=num_samples, p=weights / weights.sum())
        self.mu = np.zeros((num_samples, self._belief.size))
        for number, belief in enumerate(beliefs):
            places = np.flatnonzero(chosen == number)
            if len(places):
                self.mu[places] = belief.draw_samples(self._rng, len(places), is_even=True)
        return self

    def draw_own(self, name: str) -> Array:
        """Draws an object's own densities given its materials' mean densities, (S, M); the same in every call."""
        if name not in self._own:
            deviation = self._prior.deviation
            own = self.mu + deviation * self.mu * self._rng.standard_normal(self.mu.shape)
            columns, felt = self._columns[name], self._find_felt(name)
            chosen = list(dict.fromkeys(columns))
            if self._is_odd(name):  # its densities are unrelated to the materials' means
                parts = [part.appearance for part in self._objects[name]]
                recollection = self._memory.recall(parts, self._prior)
                drawn = recollection.densities.draw_samples(self._rng, len(own))
                for part, column in zip(recollection.columns, columns, strict=True):
                    own[:, column] = drawn[:, part]
            elif felt is not None:
                # The scatter is that by which the memory has learned from what was felt.
                precision = np.diag((deviation * felt.estimate_densities()) ** -2.0)
                covariance = np.linalg.inv(precision + felt.precision)
                mean = (self.mu[:, chosen] @ precision + felt.information_vector) @ covariance
                root = np.linalg.cholesky(0.5 * (covariance + covariance.T))
                own[:, chosen] = mean + self._rng.standard_normal(mean.shape) @ root.T
            self._own[name] = np.maximum(own, 0.0)
        return self._own[name]

    def build_geometry(self, name: str, X_TG: Array | None = None) -> Geometry:
        """Builds an object's geometry, with one column per material, in its own frame or in that of a grip."""
        geometry = measure_geometry(self._objects[name], self._columns[name], self._belief.size)
        if X_TG is None:
            return geometry
        grip = build_transform_map(np.linalg.inv(X_TG))
        return Geometry(grip @ geometry.Phi, grip @ geometry.Phi_errors)

    def draw_errors(self, name: str) -> Array:
        """Draws the errors of an object's measurements, in standard deviations, (S, G); the same in every call."""
        if name not in self._errors:
            count = len(self.build_geometry(name).Phi_errors)
            self._errors[name] = self._rng.standard_normal((len(self.mu), count))
        return self._errors[name]

    def list_checks(self, suspicion: Suspicion) -> list[str]:
        """Lists the objects that share a material with the suspected object and were not held."""
        columns = set(suspicion.columns)
        return [name for name, own in self._columns.items() if self._find_felt(name) is None and columns & set(own)]

    def concerns(self, suspicion: Suspicion, names: Iterable[str]) -> bool:
        """Returns True if one of the named objects shares a material with the suspected object."""
        return any(set(suspicion.columns) & set(self._columns[name]) for name in names)

    def _recognise(self, parts: Sequence[ComponentFeatures]) -> tuple[list[int], list[Colour]]:
        """Finds the column of each part (that of its colour or kind), and the known colours in column order."""
        recollection = self._memory.recall([part.appearance for part in parts], self._prior)
        memory, columns = recollection.memory, recollection.columns
        assert memory.at_hand is not None  # because it was just recalled
        (groups,) = memory.learner.find_groups(memory.state, memory.at_hand.seen).tolist()
        colours = memory.at_hand.thing.colours
        return [groups[column] for column in columns], [memory.colours[colours[i]] for i in dict.fromkeys(columns)]

    def _find_felt(self, name: str) -> Likelihood | None:
        """Finds the evidence about an object, in the order of its materials; None if it was not held.

        An object with the name of one that was held, but with other colours, is a different object.
        """
        felt = self._felt.get(name)
        if felt is None:
            return None
        colours = self._colours[name]
        places = [find_colour_index(felt.colours, colour) for colour in colours]
        if len(colours) != len(felt.colours) or None in places:
            return None
        return felt.own.select([place for place in places if place is not None])

    def _is_odd(self, name: str) -> bool:
        """Returns True if a learner with kinds assigns an object to a kind other than the most populous one."""
        return not set(self._columns[name]) <= set(self.common)

    def _suspect_objects(self) -> list[Suspicion]:
        """Lists the objects that were held, each with the belief without it."""
        found = []
        for name, felt in self._felt.items():
            columns = [find_colour_index(self._memory.colours, colour) for colour in felt.colours]
            known = tuple(column for column in columns if column is not None)
            rest = _leave_out(self._belief, known, felt.shared) if len(known) == len(columns) else None
            if rest is None:  # none of the objects here has its colour, or the memory has not learned from it
                continue
            own = felt.own._replace(log_constant=0.0)
            # It scatters as the memory has learned from it: the odds are the same whichever of two is left out.
            deviation, densities = self._prior.deviation, own.estimate_densities()
            strange = EMPTY_BELIEF.extend(self._prior, len(known))
            strange = strange.add_object_variation(deviation, densities=densities)
            expected = rest.select(known).add_object_variation(deviation, densities=densities)
            log_odds = np.log(ODD / (1.0 - ODD))
            for each, sign in ((strange, 1.0), (expected, -1.0)):
                log_odds += sign * each.compute_untruncated_log_evidence(own, each.condition(own))
            weight = float(np.exp(min(log_odds, _MOST_LOG_ODDS)))
            found.append(Suspicion(name, known, rest, weight, felt.shared))
        return found

    def _suspect_members(self, colours: Sequence[Colour], groups: Groups) -> list[Suspicion]:
        """Lists objects that are the only member of a colour's most populous kind.

        The belief without such an object has the prior in place of that kind.
        """
        found = []
        assert groups.counts is not None
        assert groups.prior_mean is not None
        assert groups.prior_sd is not None
        for colour, kind in zip(colours, self.common, strict=True):
            felt = {name: each for name, each in self._felt.items() if colour in each.colours}
            if groups.counts[0, kind] != 1 or not felt:
                continue
            mean = self._belief.untruncated_mean.copy()
            misses = {name: abs(_find_density(each, colour) - mean[kind]) for name, each in felt.items()}
            covariance = self._belief.covariance.copy()
            covariance[kind] = covariance[:, kind] = 0.0
            mean[kind], covariance[kind, kind] = groups.prior_mean[0, kind], groups.prior_sd[0, kind] ** 2
            belief = DensityBelief.from_moments(mean, covariance)
            found.append(Suspicion(min(misses, key=lambda name: misses[name]), (kind,), belief, ODD / (1.0 - ODD)))
        return found


def _leave_out(belief: DensityBelief, columns: Sequence[int], shared: Likelihood) -> DensityBelief | None:
    """Removes a likelihood of some densities from a belief; None if it was not part of the belief."""
    precision, vector = belief.precision.copy(), belief.information_vector.copy()
    precision[np.ix_(columns, columns)] -= shared.precision
    vector[list(columns)] -= shared.information_vector
    try:
        return DensityBelief(precision, vector)
    except BadArgumentError:
        return None


def _find_density(felt: FeltObject, colour: Colour) -> float:
    """Computes the most probable density of an object's parts of one colour, [kg/m^3], from its evidence alone."""
    densities = np.linalg.lstsq(felt.own.precision, felt.own.information_vector)[0]
    return float(densities[felt.colours.index(colour)])
