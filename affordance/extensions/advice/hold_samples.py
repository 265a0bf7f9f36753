"""Samples of the belief before a hold, which allow for one odd object.

An object can look like one material and be made of another (a decoy). A priori, each held object is odd with
probability ``ODD``. An odd object is no evidence about its apparent materials. The belief about them comes from the
other objects, and the odd object's densities have the prior of any material. The hypotheses, each with at most one
odd object, are weighted by their evidence. A single object of a material cannot contradict itself. If two objects
differ, either may be odd, and a third object decides. A learner with kinds judges oddness itself; then the only
member of a kind may be odd.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.density_belief import EMPTY_BELIEF, DensityBelief
from affordance.belief.felt_object import AtHand
from affordance.belief.holds import Felt, Holds, forget_things
from affordance.belief.learner import Groups
from affordance.belief.likelihood import Likelihood
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.one_density import OneDensity
from affordance.objects.appearance import PartAppearance, is_same_object
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
    number: int  # number of the object in the memory


class HoldSamples:
    """Samples of materials' mean densities, and of objects' deviations from them."""

    def __init__(
        self,
        memory: MaterialMemory,
        objects: Mapping[str, Sequence[ComponentFeatures]],
        settings: Settings,
        rng: np.random.Generator,
        looks: Mapping[str, Sequence[PartAppearance]] | None = None,
    ) -> None:
        """Recognises all objects, given by their parts. ``looks`` has the names of held objects."""
        prior = settings.prior
        self._objects, self._prior, self._rng = objects, prior, rng
        for parts in objects.values():
            memory = memory.recall([part.appearance for part in parts], prior).memory
        self._memory = memory
        # Columns of each object by its parts, and by its colours in the order of its densities in the memory; its
        # number in the memory, if it was held.
        self._columns: dict[str, list[int]] = {}
        self._own_columns: dict[str, list[int]] = {}
        self._numbers: dict[str, int] = {}
        for name, parts in objects.items():
            self._recognise(name, parts)
        named = {name: [part.appearance for part in parts] for name, parts in objects.items()}
        self._looks = {**(looks or {}), **named}
        groups = memory.group()
        self._belief = DensityBelief.from_moments(groups.means.mean[0], groups.means.covariance[0])
        # Columns of the belief that apply to new objects: all except minor kinds of a colour. Below them, the
        # hypotheses that one of the objects held is odd.
        self.common: list[int] = groups.common[0].tolist()
        self.suspicions: list[Suspicion] = []
        if groups.counts is not None:
            self.suspicions = self._suspect_members(groups)
        elif isinstance(memory.learner, OneDensity) and memory.learner.is_exact:
            self.suspicions = self._suspect_objects(memory.learner)
        self._own: dict[str, Array] = {}
        self._errors: dict[str, Array] = {}
        # Samples of the mean densities, (S, M), of each colour or, for a learner with kinds, of each kind; and the
        # number of the object that is odd in each sample, (S,), or -1.
        self.mu = np.zeros((0, self._belief.size))
        self._odd = np.zeros(0, dtype=int)

    def draw(self, num_samples: int, suspicion: Suspicion | None = None) -> "HoldSamples":
        """Draws samples from all hypotheses by their probability, and returns itself.

        If a suspicion is given, the evidence of its object is left out.
        """
        self._own, self._errors = {}, {}
        weights = np.array([1.0, *(each.weight for each in self.suspicions)])
        chosen = np.zeros(num_samples, dtype=int)
        if self.suspicions:
            chosen = self._rng.choice(len(weights), size=num_samples, p=weights / weights.sum())
        self.mu = np.zeros((num_samples, self._belief.size))
        self._odd = np.array([-1, *(each.number for each in self.suspicions)])[chosen]
        for number, each in enumerate((None, *self.suspicions)):
            places = np.flatnonzero(chosen == number)
            if len(places):
                belief = self._believe_without(each, suspicion)
                self.mu[places] = belief.draw_samples(self._rng, len(places), is_even=True)
        return self

    def draw_own(self, name: str) -> Array:
        """Draws an object's densities given its materials' mean densities, (S, M).

        Every call returns the same draws.
        """
        if name not in self._own:
            deviation, prior, number = self._prior.deviation, self._prior, self._numbers.get(name)
            own = self.mu + deviation * self.mu * self._rng.standard_normal(self.mu.shape)
            if self._is_odd(name):  # its densities are unrelated to the materials' means
                parts = [part.appearance for part in self._objects[name]]
                recollection = self._memory.recall(parts, self._prior)
                drawn = recollection.densities.draw_samples(self._rng, len(own))
                for part, column in zip(recollection.columns, self._columns[name], strict=True):
                    own[:, column] = drawn[:, part]
            elif number is not None:
                chosen = self._own_columns[name]
                mean, sd = self.mu[:, chosen], deviation * self.mu[:, chosen]
                is_odd = self._odd == number
                mean[is_odd] = prior.mode
                sd[is_odd] = np.hypot(prior.sd, deviation * np.hypot(prior.mode, prior.sd))
                # Bayes' rule with covariance R^2, R = diag(sd): the posterior's is R B^-1 R with B = I + R P R.
                P, q = self._find_felt(number)[:2]
                B = np.eye(len(chosen)) + sd[:, :, None] * P * sd[:, None, :]
                root = np.swapaxes(np.linalg.cholesky(B), 1, 2)
                noise = np.linalg.solve(root, self._rng.standard_normal((*mean.shape, 1)))[..., 0]
                shift = np.linalg.solve(B, (sd * (q - mean @ P))[..., None])[..., 0]
                own[:, chosen] = mean + sd * (shift + noise)
            self._own[name] = np.maximum(own, 0.0)
        return self._own[name]

    def build_geometry(self, name: str, X_TG: Array | None = None) -> Geometry:
        """Builds an object's geometry with one column per material. The frame is the object's own, or a grip's."""
        geometry = measure_geometry(self._objects[name], self._columns[name], self._belief.size)
        if X_TG is None:
            return geometry
        grip = build_transform_map(np.linalg.inv(X_TG))
        return Geometry(grip @ geometry.Phi, grip @ geometry.Phi_errors)

    def draw_errors(self, name: str) -> Array:
        """Draws the measurement errors of an object, in standard deviations, (S, G).

        Every call returns the same draws.
        """
        if name not in self._errors:
            count = len(self.build_geometry(name).Phi_errors)
            self._errors[name] = self._rng.standard_normal((len(self.mu), count))
        return self._errors[name]

    def list_checks(self, suspicion: Suspicion) -> list[str]:
        """Lists the objects that share a material with a suspect and were never held."""
        columns = set(suspicion.columns)
        return [name for name, own in self._columns.items() if name not in self._numbers and columns & set(own)]

    def concerns(self, suspicion: Suspicion, names: Iterable[str]) -> bool:
        """Returns True if a named object shares a material with the suspected object."""
        return any(set(suspicion.columns) & set(self._columns[name]) for name in names)

    def _recognise(self, name: str, parts: Sequence[ComponentFeatures]) -> None:
        """Finds the column of each part of an object, and the object in the memory.

        A column belongs to a colour or kind.
        """
        recollection = self._memory.recall([part.appearance for part in parts], self._prior)
        memory, at_hand = recollection.memory, recollection.memory.at_hand
        assert at_hand is not None  # because it was just recalled
        (self._own_columns[name],) = memory.learner.find_groups(memory.state, at_hand.seen).tolist()
        self._columns[name] = [self._own_columns[name][column] for column in recollection.columns]
        if at_hand.number < len(memory.things):
            self._numbers[name] = at_hand.number

    def _find_felt(self, number: int) -> Likelihood:
        """Computes the quadratic log likelihood of a held object's densities from all holds.

        The approximation agrees with the exact log likelihood at the most probable densities for the prior of any
        material. Densities drawn with it have means right to 2 % and SDs to 5 % where objects differ by a factor of
        1.3 (against quadrature); with a factor of 2 SDs are up to 9 % too small, but then it is almost certain that
        one of them is odd.
        """
        size = len(self._memory.things[number].colours)
        holds = Holds.of(forget_things(self._memory.state, [number]))
        holds = holds._replace(regressor=holds.regressor[..., :size], errors=holds.errors[..., :size])
        felt = Felt(holds, np.zeros(1), 0, np.zeros(1))
        return felt.find_likelihood(EMPTY_BELIEF.extend(self._prior, size).normals).take(0)

    def _find_name(self, number: int) -> str:
        """Finds the name of a held object, or its number, counted from 1."""
        appearance = self._memory.things[number].appearance
        same = (name for name, look in self._looks.items() if is_same_object(appearance, look))
        return next(same, f"object {number + 1}")

    def _believe_without(self, one: Suspicion | None, other: Suspicion | None) -> DensityBelief:
        """Computes the belief about materials without one or two suspects."""
        odd = [each for each in (other, one) if each is not None]
        if len({each.number for each in odd}) < 2 or not isinstance(self._memory.learner, OneDensity):
            return odd[0].belief if odd else self._belief
        learner = self._memory.learner
        state, _ = learner.infer(learner.leave_out(self._memory.state, [each.number for each in odd]))
        return DensityBelief.from_normals(learner.believe(state))

    def _is_odd(self, name: str) -> bool:
        """Returns True if an object's kind is not the most populous one."""
        return not set(self._columns[name]) <= set(self.common)

    def _suspect_objects(self, learner: OneDensity) -> list[Suspicion]:
        """Lists held objects as suspects, each with the belief without it.

        An object is suspected only if it shares a material with these objects. The odds are a ratio of evidence. The
        numerator is the object's evidence alone, from the prior of any material, times the evidence of all others.
        The denominator is the evidence of all holds.
        """
        found, state, prior = [], self._memory.state, self._prior
        here = {column for own in self._columns.values() for column in own}
        things = range(len(self._memory.things))
        size = self._belief.size
        any_material = {
            "precision": np.eye(size)[None] / prior.sd**2,
            "information": np.full((1, size), prior.mode / prior.sd**2),
        }
        log_all = learner.infer(state)[1].log_evidence
        for number, thing in enumerate(self._memory.things):
            if here.isdisjoint(thing.colours):
                continue
            rest, of_rest = learner.infer(learner.leave_out(state, [number]))
            alone = learner.leave_out(state, [other for other in things if other != number])
            strange = learner.infer({**alone, **any_material})[1]
            log_ratio = float(np.squeeze(strange.log_evidence + of_rest.log_evidence - log_all))
            weight = ODD / (1.0 - ODD) * float(np.exp(min(log_ratio, _MOST_LOG_ODDS)))
            belief = DensityBelief.from_normals(learner.believe(rest))
            found.append(Suspicion(self._find_name(number), thing.colours, belief, weight, number))
        return found

    def _suspect_members(self, groups: Groups) -> list[Suspicion]:
        """Lists objects that are the only member of a colour's most populous kind.

        The belief without such an object has the prior in place of that kind.
        """
        found = []
        memory = self._memory
        assert groups.counts is not None
        assert groups.prior_mean is not None
        assert groups.prior_sd is not None
        for number, thing in enumerate(memory.things):
            for kind in memory.learner.find_groups(memory.state, AtHand(thing, number).seen)[0].tolist():
                if kind not in self.common or groups.counts[0, kind] != 1:
                    continue
                mean, covariance = self._belief.untruncated_mean.copy(), self._belief.covariance.copy()
                covariance[kind] = covariance[:, kind] = 0.0
                mean[kind], covariance[kind, kind] = groups.prior_mean[0, kind], groups.prior_sd[0, kind] ** 2
                belief = DensityBelief.from_moments(mean, covariance)
                found.append(Suspicion(self._find_name(number), (kind,), belief, ODD / (1.0 - ODD), number))
        return found
