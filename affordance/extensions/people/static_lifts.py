"""Closed-form lifts of many observers, without simulating motion.

In each lift an observer sees an object, pushes with the believed weight (``control.hold``), holds the object, and
learns from noisy static joint torques. The arm is the same as in all simulations, in its home posture. Rows of arrays
are independent observers.
"""

import copy
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array, Mask
from affordance.belief.colour_recognition import find_colour_index
from affordance.belief.density_belief import DENSITY_FLOOR, DensityBelief, PointEstimate
from affordance.belief.felt_object import Thing
from affordance.belief.holds import Felt
from affordance.belief.learner import Draws, Learner, Lesson, Seen, State
from affordance.belief.normals import Normals
from affordance.belief.rows import put_rows, take_rows
from affordance.exceptions import BadArgumentError
from affordance.extensions.people.participant import Pushes
from affordance.objects.appearance import Appearance, is_same_object
from affordance.objects.colour import Colour
from affordance.objects.inertia import build_inertia_map
from affordance.objects.tool import Tool
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.proprioception.static_hold import StaticHold
from affordance.proprioception.torque_noise import WeberNoise
from affordance.runs.random_streams import ObserverDraws, Stream
from affordance.settings import Settings
from affordance.vision.eye import measure_features
from affordance.vision.features import VisionError

# Object number in trials without a lift.
NOTHING = -1


class LiftedObservers(NamedTuple):
    """Learned densities and lifted objects of B observers."""

    state: State  # state of the learner, with the same numbers of objects as here
    # Number of the first lift of each object, (B, objects); infinite if it was never lifted. Objects that look the
    # same are one object.
    order: Array


class LiftRecord(NamedTuple):
    """Record of N lifts by B observers, (N, B) each. In trials without a lift, entries are NaN, or 0 for the kind."""

    force: Array  # upward force before release, [N]
    weight: Array  # true weight, [N]
    expected: Array  # mass at the most probable densities before the lift, [kg]
    believed_density: Array  # most probable density of the first part's colour before the lift, [kg/m^3]
    kind: NDArray[np.intp]  # kind of the first part within its colour after the lift, from 1; 0 without kinds
    p_value: Array  # predictive p-value of the measurement before the lift; NaN if nothing is learned
    felt: Array  # weight at the most probable densities after the lift, [N]; NaN if nothing is learned
    expected_by_look: Array  # weight expected before the lift of a new object with this appearance, [N]
    after: LiftedObservers


class _SeenTool(NamedTuple):
    """Constant quantities of an object."""

    appearance: Appearance  # with known colours
    colours: tuple[int, ...]  # colour index of each part
    Phi: Array  # inertia map with one column per part, (10, num_parts)
    tau: Array  # true joint torques while holding the object, (num_joints,), [N m]
    weight: float  # [N]


def check_closed_form(settings: Settings) -> WeberNoise:
    """Checks that settings allow closed-form lifts, and returns the torque noise.

    Raises:
        BadArgumentError: Visual features are not exact, or torque errors are not constant within a trial.
    """
    noise, where = settings.noise, "for lifts in closed form"
    if not isinstance(noise, WeberNoise):
        raise BadArgumentError("Settings", "noise", f"is {type(noise).__name__}, must be WeberNoise {where}")
    if noise.independent_samples:
        raise BadArgumentError("Settings", "noise.independent_samples", f"is true, must be false {where}")
    if settings.vision_error != VisionError():
        raise BadArgumentError("Settings", "vision_error", f"is {settings.vision_error}, must be zero {where}")
    return noise


class StaticLifter:
    """Closed-form lifts of a set of objects."""

    def __init__(self, tools: Sequence[Tool], settings: Settings) -> None:
        """Precomputes constant quantities; errors are as in ``check_closed_form`` and ``load_arm``."""
        self._noise = check_closed_form(settings)
        arm = load_arm(settings.arm)
        self.settings = settings
        self._learner = settings.learner
        self._hold = StaticHold(arm)
        self.gravity = float(np.linalg.norm(ArmModel(arm).gravity))
        self.colours: list[Colour] = []
        self._tools = [self._see(tool) for tool in tools]
        # Objects that differ only in mass look exactly the same. Only different appearances are compared, on demand.
        looks = {(each.colours, each.appearance): each for each in self._tools}
        number = {look: number for number, look in enumerate(looks)}
        self._look = np.array([number[each.colours, each.appearance] for each in self._tools])
        self._looks, self._same = [*looks.values()], np.full((len(looks), len(looks)), -1, dtype=np.int8)
        self._weights = np.array([each.weight for each in self._tools])
        self._tau = np.array([each.tau for each in self._tools])
        self._first = np.array([each.colours[0] for each in self._tools])
        palettes = [tuple(dict.fromkeys(each.colours)) for each in self._tools]
        self._palettes = list(dict.fromkeys(palettes))  # different sets of colours
        numbers = {palette: number for number, palette in enumerate(self._palettes)}
        self._palette = np.array([numbers[palette] for palette in palettes])

    def start(self, seeds: Sequence[tuple[int, ...]]) -> LiftedObservers:
        """Creates inexperienced observers, with one seed for the learner of each observer."""
        learner, size = self._learner, len(seeds)
        draws = ObserverDraws([(*seed, 0) for seed in seeds])
        state = learner.start(draws, learner.parameters, self.settings.prior, len(self.colours), size)
        return LiftedObservers(state, np.full((size, len(self._tools)), np.inf))

    def mark_met(self, observers: LiftedObservers, number: int) -> LiftedObservers:
        """Marks an object as known to all observers, without learning."""
        order = observers.order.copy()
        things = self.identify(np.full(len(order), number), order)
        order[np.arange(len(order)), things] = np.minimum(order[np.arange(len(order)), things], 0.0)
        return observers._replace(order=order)

    def list_things(self, observers: LiftedObservers) -> tuple[Thing, ...]:
        """Lists all objects of a single observer. Unknown objects have no appearance."""
        pairs = zip(self._tools, np.isfinite(observers.order[0]), strict=True)
        return tuple(
            Thing(tool.appearance, tuple(dict.fromkeys(tool.colours))) if is_met else Thing((), ())
            for tool, is_met in pairs
        )

    def draw_errors(self, seeds: Sequence[tuple[int, ...]], num_lifts: int) -> Array:
        """Draws gain and offset errors of N lifts, (N, B, 2, num_joints), seeded by observer and lift number."""
        numbers, num_joints = range(1, num_lifts + 1), self._tau.shape[1]  # from 1: a trailing 0 is no new seed
        drawn = [[self._noise.draw_trial_errors((*seed, number), num_joints) for seed in seeds] for number in numbers]
        return np.array(drawn).reshape(num_lifts, len(seeds), 2, num_joints)

    def run(
        self,
        objects: NDArray[np.intp],
        observers: LiftedObservers,
        errors: Array,
        seeds: Sequence[tuple[int, ...]],
        teaches: Mask | None = None,
        pushes: Pushes | None = None,
    ) -> LiftRecord:
        """Computes N lifts of B observers.

        Args:
            objects: Number of the object that each observer lifts, (N, B); NOTHING for no lift.
            observers: State of the observers before the first lift.
            errors: Measurement errors; see ``draw_errors``.
            seeds: Seed of each observer, which seeds the learner's random draws together with the number of the lift.
            teaches: True where an observer learns from a lift, (N, B); None for all lifts.
            pushes: Push parameters; None for pushes that equal the believed weight.
        """
        state, order, everyone = observers.state, observers.order.copy(), np.arange(objects.shape[1])
        force, expected, believed, p_value, felt, by_look = (np.full(objects.shape, np.nan) for _ in range(6))
        last = np.full(len(everyone), np.nan)  # believed weight in the previous lift, [N]
        kind, learned = np.zeros(objects.shape, dtype=np.intp), np.zeros(len(everyone), dtype=np.intp)
        is_taught = (objects != NOTHING) & (np.ones(objects.shape, dtype=bool) if teaches is None else teaches)
        for number, (chosen, taught) in enumerate(zip(objects, is_taught, strict=True)):
            things = self.identify(chosen, order)
            order[everyone, things] = np.minimum(order[everyone, things], np.where(taught, number, np.inf))
            learned += taught
            for rows, colours in self._group(chosen, things, taught):
                seen, lifted, learns = Seen(colours, things[rows]), chosen[rows], bool(taught[rows[0]])
                own = state if len(rows) == len(everyone) else take_rows(state, rows)
                Phi = self.gather(lifted, colours)
                before = self._learner.expect(own, seen)
                mode = before.compute_mode(DENSITY_FLOOR)
                expected[number, rows] = np.vecdot(Phi[:, 0], mode)
                rho = self._estimate(before, mode, [(*seeds[row], number + 1, Stream.LIFT_DENSITY) for row in rows])
                weight = np.vecdot(Phi[:, 0], rho) * self.gravity
                if pushes is None:
                    force[number, rows] = weight
                else:
                    draws = ObserverDraws([(*seeds[row], number + 1, Stream.PUSH) for row in rows])
                    force[number, rows] = pushes.take(rows).draw(weight, last[rows], draws)
                last[rows] = weight
                first = self._first[lifted]
                modes = self._learner.believe(own).compute_mode(DENSITY_FLOOR)
                believed[number, rows] = modes[np.arange(len(rows)), first]
                by_look[number, rows] = np.vecdot(Phi[:, 0], modes[:, list(colours)]) * self.gravity
                if learns:
                    draws = ObserverDraws([(*seeds[row], int(learned[row])) for row in rows])
                    own, densities, likelihood = self.feel(own, seen, lifted, Phi, errors[number, rows], draws)
                    p_value[number, rows] = before.compute_p_value(likelihood)
                    felt[number, rows] = np.vecdot(Phi[:, 0], densities.compute_mode(DENSITY_FLOOR)) * self.gravity
                    state = own if len(rows) == len(everyone) else put_rows(state, rows, own)
                known = np.isfinite(order[rows, things[rows]])
                kind[number, rows] = np.where(known, self._number_kinds(own, seen, first), 0)
        weight = np.where(objects == NOTHING, np.nan, self._weights[objects])
        after = LiftedObservers(state, order)
        return LiftRecord(force, weight, expected, believed, kind, p_value, felt, by_look, after)

    @property
    def num_joints(self) -> int:
        """Number of joints."""
        return int(self._tau.shape[1])

    @property
    def error_sds(self) -> Array:
        """Standard deviations of gain and offset errors, (2,)."""
        return np.array([self._noise.weber_fraction, self._noise.threshold])

    def of_learner(self, learner: Learner) -> "StaticLifter":
        """Returns a copy with the same objects and another learner."""
        other = copy.copy(self)
        other._learner = learner
        return other

    def list_colours(self, number: int) -> tuple[int, ...]:
        """Lists the different colour indices of an object."""
        return tuple(dict.fromkeys(self._tools[number].colours))

    def feel(
        self, state: State, seen: Seen, lifted: NDArray[np.intp], Phi: Array, errors: Array, draws: Draws
    ) -> Lesson:
        """Updates B observers with a measurement of one object each; errors are (B, 2, num_joints)."""
        gain, offset = np.moveaxis(errors, 1, 0)
        tau = self._tau[lifted] * (1.0 + gain) + offset
        noise = self._noise.threshold, self._noise.weber_fraction
        felt = Felt.from_torques(tau, self._hold.tau_arm, self._hold.Y @ Phi, noise)
        return self._learner.learn(state, seen, felt, draws)

    def _see(self, tool: Tool) -> _SeenTool:
        features = measure_features(tool, VisionError(), np.random.default_rng(0))  # exact
        count, colours = len(features), list[int]()
        for part in features:
            index = find_colour_index(self.colours, part.colour)
            if index is None:
                index = len(self.colours)
                self.colours.append(part.colour)
            colours.append(index)
        Phi = build_inertia_map(
            [part.shape for part in features], [part.X_TE for part in features], range(count), count
        )
        pairs = zip(features, colours, strict=True)
        return _SeenTool(
            tuple(part.appearance._replace(colour=self.colours[index]) for part, index in pairs),
            tuple(colours),
            Phi,
            self._hold.tau_arm + self._hold.Y @ tool.parameters,
            self.gravity * tool.mass,
        )

    def gather(self, lifted: NDArray[np.intp], colours: tuple[int, ...]) -> Array:
        """Builds the inertia maps of n objects, with one column for each of m colours, (n, 10, m)."""
        numbers, places = np.unique(lifted, return_inverse=True)
        maps = []
        for tool in (self._tools[number] for number in numbers):
            columns = np.array(tool.colours)[:, None] == np.array(colours)
            maps.append(tool.Phi @ columns)
        return np.array(maps)[places]

    def identify(self, chosen: NDArray[np.intp], order: Array) -> NDArray[np.intp]:
        """Finds the first known object that looks like the chosen object, or else the chosen object itself, (B,)."""
        looks = self._look[chosen]
        rows, columns = np.unique(looks), np.unique(self._look[np.isfinite(order).any(axis=0)])
        for i, j in np.argwhere(self._same[np.ix_(rows, columns)] < 0):
            pair = rows[i], columns[j]
            self._same[pair] = _is_same_thing(*(self._looks[look] for look in pair))
        known = np.where(self._same[looks][:, self._look] > 0, order, np.inf)
        return np.where(np.isfinite(known).any(axis=1), known.argmin(axis=1), np.maximum(chosen, 0))

    def identify_all(self, objects: NDArray[np.intp], teaches: Mask) -> NDArray[np.intp]:
        """Finds the object that one observer recognises in each of N lifts, (N,)."""
        things, order = np.empty_like(objects), np.full((1, len(self._tools)), np.inf)
        for number, (lifted, is_taught) in enumerate(zip(objects, teaches, strict=True)):
            things[number] = thing = self.identify(np.array([lifted]), order)[0]
            if is_taught:
                order[0, thing] = min(order[0, thing], number)
        return things

    def _group(
        self, chosen: NDArray[np.intp], things: NDArray[np.intp], taught: Mask
    ) -> Iterator[tuple[NDArray[np.intp], tuple[int, ...]]]:
        """Groups observers by the colours of their objects and by learning.

        Yields: Indices of the observers in each group, and the colours.
        """
        keys = np.where(chosen == NOTHING, NOTHING, 2 * self._palette[things] + taught)
        for key in np.unique(keys[keys != NOTHING]):
            yield np.flatnonzero(keys == key), self._palettes[key // 2]

    def _estimate(self, before: Normals, mode: Array, seeds: Sequence[tuple[int, ...]]) -> Array:
        """Computes the point estimates of densities for control, (n, m). The seeds are for sampled densities."""
        if (point_estimate := self.settings.point_estimate) is PointEstimate.MODE:
            return mode
        beliefs = (
            DensityBelief.from_moments(*moments) for moments in zip(before.mean, before.covariance, strict=True)
        )
        pairs = zip(beliefs, seeds, strict=True)
        return np.array(
            [belief.compute_point_estimate(point_estimate, np.random.default_rng(seed)) for belief, seed in pairs]
        )

    def _number_kinds(self, state: State, seen: Seen, first: NDArray[np.intp]) -> NDArray[np.intp]:
        """Numbers the kind of each object's first part within its colour, from 1, (n,); 0 without kinds."""
        groups = self._learner.group(state)
        if groups.counts is None:
            return np.zeros(len(first), dtype=np.intp)
        kinds = self._learner.find_groups(state, seen)[first[:, None] == np.array(seen.colours)]
        before = np.arange(groups.colours.shape[1]) < kinds[:, None]
        numbers: NDArray[np.intp] = 1 + (before & (groups.colours == first[:, None])).sum(axis=1)
        return numbers


def _is_same_thing(tool: _SeenTool, thing: _SeenTool) -> bool:
    return set(tool.colours) == set(thing.colours) and is_same_object(thing.appearance, tool.appearance)
