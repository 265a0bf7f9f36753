"""State of the learner ``Kinds`` for B observers.

A kind is a group of objects of one colour with a common mean density. A colour has one or more kinds. A thing is a
lifted object; it belongs to one kind for each of its colours. A thing that changes its kind is treated as a different
object with the same appearance. Such a pair of a thing and its kinds is called a specimen. It has its own holds and
its own deviations from the mean densities. If a thing returns to an earlier kind, the holds of that specimen count
again. The belief about the mean densities is the posterior given all holds and the kinds of all specimens
(``exact``).

After each lift, kinds without things are removed, and twins are merged. Twins are two kinds of a colour whose mean
densities differ by less than the scatter of objects within a material, with a probability above one half. This
scatter is ``deviation`` times the average of both means.

Each observer's kinds fill the first places of its row, the oldest first. Unused places and the entries of things that
were never lifted are zero. A new kind is first appended to all rows; ``tidy`` then closes the gaps.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from affordance.arrays import Array, Mask
from affordance.belief.exact import Experience, compute_posterior
from affordance.belief.holds import Holds, keep_holds, start_holds
from affordance.belief.learner import Seen, State
from affordance.belief.normals import Normals
from affordance.belief.rows import make_room, pad, put_rows, take_rows

# Arrays of K kinds, (B, K, ...): index of the colour, True if the place holds a kind, mean and SD of each kind before
# its first lift, and mean and covariance of the mean densities that follow from all holds, [kg/m^3].
OF_KINDS = ("kind_colour", "is_kind", "kind_mean", "kind_sd", "mean", "covariance")
# Arrays of T things, (B, T, C, ...), with a column for each colour: index of the kind, number n of consecutive lifts
# with this kind up to the last lift, and probability of the kind after the last lift. If the kind is not the most
# populous kind of the colour, the belief about the thing's own density follows, [kg/m^3].
OF_THINGS = ("thing_kind", "num_lifts", "probability", "is_own", "own_mean", "own_covariance")
# Arrays of S specimens: number of the thing plus one, (B, S), and index of each colour's kind plus one, (B, S, C).
# Unused places are zero. The module ``holds`` refers to specimens as things.
OF_SPECIMENS = ("specimen_thing", "specimen_kind")
_NO_SPECIMENS = dict(zip(OF_SPECIMENS, ((0,), (0, 0)), strict=True))


class KindPrior(NamedTuple):
    """Normal prior of a kind's mean density, (B,) each, [kg/m^3]."""

    mean: Array
    sd: Array


def start_kinds(num_colours: int, prior: KindPrior) -> State:
    """Returns the initial entries of a state: one kind per colour, and no objects."""
    size, K = len(prior.mean), num_colours
    of_kinds: State = {
        "kind_colour": np.tile(np.arange(K), (size, 1)),
        "is_kind": np.ones((size, K), dtype=bool),
        "kind_mean": np.tile(prior.mean[:, None], (1, K)),
        "kind_sd": np.tile(prior.sd[:, None], (1, K)),
        "mean": np.tile(prior.mean[:, None], (1, K)),
        "covariance": prior.sd[:, None, None] ** 2 * np.eye(K),
    }
    of_things: State = {
        "thing_kind": np.zeros((size, 0, 0), dtype=np.intp),
        "num_lifts": np.zeros((size, 0, 0), dtype=np.intp),
        "probability": np.zeros((size, 0, 0)),
        "is_own": np.zeros((size, 0, 0), dtype=bool),
        "own_mean": np.zeros((size, 0, 0)),
        "own_covariance": np.zeros((size, 0, 0, 0)),
    }
    specimens: State = {name: np.zeros((size, *shape), dtype=np.intp) for name, shape in _NO_SPECIMENS.items()}
    return {**of_kinds, **of_things, **specimens, **start_holds(size)}


def make_room_for_thing(state: State, seen: Seen) -> State:
    """Enlarges the arrays of things so that they have room for an object."""
    return make_room(state, OF_THINGS, seen)


def believe_kinds(state: State) -> Normals:
    """Returns the belief about the mean densities of K kinds, (B, K). Unused places are N(0, 1)."""
    absent = np.eye(state["is_kind"].shape[1]) * ~state["is_kind"][:, None, :]
    return Normals(state["mean"], state["covariance"] + absent)


def find_specimens(state: State, things: NDArray[np.intp]) -> tuple[State, NDArray[np.intp]]:
    """Finds the specimen of each observer's object with its present kinds.

    Returns:
        State, to which a new specimen may have been added, and index of the specimen, (B,).
    """
    rows = np.arange(len(things))
    key = np.where(state["num_lifts"][rows, things] > 0, state["thing_kind"][rows, things] + 1, 0)  # (B, C)
    kinds = pad(state["specimen_kind"], (state["specimen_kind"].shape[1], key.shape[1]))
    same = (state["specimen_thing"] == things[:, None] + 1) & (kinds == key[:, None]).all(axis=2)
    count = (state["specimen_thing"] > 0).sum(axis=1)
    place = np.where(same.any(axis=1), same.argmax(axis=1) if same.shape[1] else 0, count)
    room = max(same.shape[1], int(place.max(initial=-1)) + 1)
    of_thing, kinds = pad(state["specimen_thing"], (room,)).copy(), pad(kinds, (room, key.shape[1])).copy()
    of_thing[rows, place], kinds[rows, place] = things + 1, key
    return {**state, "specimen_thing": of_thing, "specimen_kind": kinds}, place


def infer_kinds(state: State, things: NDArray[np.intp]) -> tuple[State, Normals]:
    """Computes the belief about all kinds from all holds.

    Returns:
        State with this belief, and the belief about the densities of each observer's object, (B, C).
    """
    is_kind, (state, specimens) = state["is_kind"], find_specimens(state, things)
    sd = np.where(is_kind, state["kind_sd"], 1.0)
    prior = Normals(state["kind_mean"], sd[..., None] ** 2 * np.eye(sd.shape[1]))
    kinds = state["specimen_kind"]
    of_things = np.maximum(kinds - 1, 0), kinds > 0, state["deviation"]
    found = compute_posterior(Experience(prior, Holds.of(state), *of_things, specimens))
    both = is_kind[:, :, None] & is_kind[:, None, :]
    covariance = np.where(both, found.means.covariance, 0.0)
    assert found.own is not None
    return {**state, "mean": np.where(is_kind, found.means.mean, 0.0), "covariance": covariance}, found.own


def infer_kind(state: State, things: NDArray[np.intp]) -> tuple[State, Normals]:
    """Updates the belief about the kind of each observer's object; objects must have one colour each.

    The belief about all other kinds must be up to date. The results are the same as from ``infer_kinds``.
    """
    rows = np.arange(len(things))
    kind = state["thing_kind"][rows, things, 0]
    part = keep_specimens(state, state["specimen_kind"][..., 0] == kind[:, None] + 1)
    part = {**part, **{name: state[name][rows, kind][:, None] for name in ("is_kind", "kind_mean", "kind_sd")}}
    part["specimen_kind"] = (part["specimen_kind"] > 0).astype(np.intp)
    part["thing_kind"] = np.zeros_like(state["thing_kind"])
    found, own = infer_kinds(part, things)
    state = {**state, **{name: state[name].copy() for name in ("mean", "covariance")}}
    state["mean"][rows, kind] = found["mean"][:, 0]
    state["covariance"][rows, kind, kind] = found["covariance"][:, 0, 0]
    return state, own


def keep_specimens(state: State, kept: Mask) -> State:
    """Removes all specimens that are not selected by a mask, (B, S), with their holds."""
    if not kept.size:
        return state
    order = np.argsort(~kept, axis=1, kind="stable")
    rows, places = np.arange(len(order))[:, None], np.argsort(order, axis=1)
    held = (state["hold_count"] > 0) & np.take_along_axis(kept, state["hold_thing"], axis=1)
    state = {**state, "hold_thing": np.where(held, np.take_along_axis(places, state["hold_thing"], axis=1), 0)}
    is_there = np.take_along_axis(kept, order, axis=1)
    room = int(kept.sum(axis=1).max(initial=0))
    order, is_there = order[:, :room], is_there[:, :room]
    specimens = {
        "specimen_thing": np.where(is_there, state["specimen_thing"][rows, order], 0),
        "specimen_kind": np.where(is_there[..., None], state["specimen_kind"][rows, order], 0),
    }
    return {**keep_holds(state, held), **specimens}


def count_things(state: State, excluded: NDArray[np.intp] | None = None) -> NDArray[np.intp]:
    """Counts the objects of each kind, (B, K), optionally without one object per observer."""
    counted = state["num_lifts"] > 0
    if excluded is not None:
        counted = counted & (np.arange(counted.shape[1]) != excluded[:, None])[:, :, None]
    kinds = np.arange(state["is_kind"].shape[1])
    counts: NDArray[np.intp] = (counted[..., None] & (state["thing_kind"][..., None] == kinds)).sum(axis=(1, 2))
    return counts


def find_most_populous(state: State, colours: Sequence[int]) -> NDArray[np.intp]:
    """Finds the kind with the most objects for each colour, (B, colours). The oldest kind wins a tie."""
    counts = count_things(state)[:, None, :]
    candidates = mark_kinds(state, colours)
    return np.where(candidates, counts, -1).argmax(axis=2)


def mark_kinds(state: State, colours: Sequence[int]) -> Mask:
    """Returns a mask of the kinds that belong to each colour, (B, colours, K)."""
    of_colour = state["kind_colour"][:, None, :] == np.asarray(colours, dtype=np.intp)[:, None]
    marked: Mask = of_colour & state["is_kind"][:, None, :]
    return marked


def add_kinds(state: State, colours: Sequence[int], priors: Sequence[KindPrior], is_kind: Mask) -> State:
    """Adds one place per colour for a new kind.

    Args:
        state: State of B observers.
        colours: Colours of the new kinds.
        priors: Prior of each new kind.
        is_kind: True where the observer gets the new kind; other places remain unused, (B, colours).
    """
    K, count = state["is_kind"].shape[1], len(colours)
    shapes = {name: (K + count,) * (state[name].ndim - 1) for name in OF_KINDS}
    state = {**state, **{name: pad(state[name], shape).copy() for name, shape in shapes.items()}}
    state["kind_colour"][:, K:] = np.where(is_kind, colours, 0)
    state["is_kind"][:, K:] = is_kind
    for place, prior in enumerate(priors):
        there = is_kind[:, place]
        values = {"mean": prior.mean, "kind_mean": prior.mean, "kind_sd": prior.sd}
        for name, value in values.items():
            state[name][:, K + place] = np.where(there, value, 0.0)
        state["covariance"][:, K + place, K + place] = np.where(there, prior.sd**2, 0.0)
    return state


def tidy(state: State, things: NDArray[np.intp], *, is_inferred: bool = False) -> tuple[State, Normals]:
    """Removes empty kinds after a hold, updates the belief, and merges twins.

    Args:
        state: State of B observers.
        things: Number of the held object of each observer, (B,).
        is_inferred: True if the stored belief includes all holds but the last, with the same deviations.

    Returns:
        State, and belief about the densities of each observer's held object, (B, C). The state keeps own densities
        only for objects outside the most populous kind.
    """
    counts, same = count_things(state), _mark_same_colours(state)
    # A colour that was seen but never lifted keeps its only kind, although that kind has no objects.
    is_lifted = (same & (counts > 0)[:, None, :]).any(axis=2)
    state = close_gaps(remove_kinds(state, state["is_kind"] & is_lifted & (counts == 0)))
    has_one_colour = state["thing_kind"].shape[2] == 1  # a hold then changes the belief about one kind only
    state, own = (infer_kind if is_inferred and has_one_colour else infer_kinds)(state, things)
    left = np.flatnonzero(_mark_same_colours(state).sum(axis=(1, 2)) > state["is_kind"].sum(axis=1))
    while len(left):
        one, other, are_twins = find_twins({name: state[name][left] for name in (*OF_KINDS, "deviation")})
        left = left[are_twins]
        if len(left):
            state = close_gaps(merge(state, left, one[are_twins], other[are_twins]))
            part, of_part = infer_kinds(take_rows(state, left), things[left])
            state = put_rows(state, left, part)
            own.mean[left], own.covariance[left] = of_part.mean, of_part.covariance
    counts = count_things(state)
    is_larger = counts[:, None, :] > counts[:, :, None]
    is_older = (counts[:, None, :] == counts[:, :, None]) & np.tri(counts.shape[1], k=-1, dtype=bool)
    is_second = (_mark_same_colours(state) & (is_larger | is_older)).any(axis=2)
    is_odd = np.take_along_axis(is_second[:, None, :], state["thing_kind"], axis=2)
    rows, m = np.arange(len(things)), state["is_own"].shape[2]
    state = {**state, **{name: state[name].copy() for name in ("own_mean", "own_covariance")}}
    state["own_mean"][rows, things] = own.mean[:, :m]
    state["own_covariance"][rows, things] = own.covariance[:, :m, :m]
    return _forget_own(state, is_odd), own


def remove_kinds(state: State, removed: Mask) -> State:
    """Removes kinds without objects, (B, K), and their holds."""
    state = _copy_kinds(state)
    kinds = state["specimen_kind"]
    gone = (
        np.take_along_axis(removed[:, None], np.maximum(kinds - 1, 0), axis=2) & (kinds > 0)
        if kinds.size
        else kinds > 0
    )
    state = keep_specimens(state, (state["specimen_thing"] > 0) & ~gone.any(axis=2))
    for kind in np.flatnonzero(removed.any(axis=0)):
        rows = np.flatnonzero(removed[:, kind])
        _clear(state, rows, np.full(len(rows), kind))
    return state


def find_twins(state: State) -> tuple[NDArray[np.intp], NDArray[np.intp], Mask]:
    """Finds for each observer a pair of kinds of one colour that probably have the same density.

    Returns:
        Index of the older kind, index of the younger kind, and True if such a pair exists, (B,) each.
    """
    believed = believe_kinds(state)
    mean, covariance = believed.mean, believed.covariance
    K = mean.shape[1]
    pairs = _mark_same_colours(state) & np.triu(np.ones((K, K), dtype=bool), k=1)
    rows, one, other = np.nonzero(pairs)
    variance = covariance[rows, one, one] + covariance[rows, other, other] - 2.0 * covariance[rows, one, other]
    difference, sd = mean[rows, one] - mean[rows, other], np.sqrt(variance)
    bound = state["deviation"][rows] * np.abs(mean[rows, one] + mean[rows, other]) / 2.0
    pairs[rows, one, other] = ndtr((bound - difference) / sd) - ndtr((-bound - difference) / sd) > 0.5
    first = pairs.reshape(len(pairs), K * K).argmax(axis=1) if K else np.zeros(len(pairs), dtype=np.intp)
    return first // max(K, 1), first % max(K, 1), pairs.any(axis=(1, 2))


def merge(state: State, rows: NDArray[np.intp], kept: NDArray[np.intp], merged: NDArray[np.intp]) -> State:
    """Merges two kinds of some observers; all objects then count as if they had always belonged to the older kind.

    The belief is not updated.

    Args:
        state: State of B observers.
        rows: Numbers of the R observers, (R,).
        kept: Index of the older kind, (R,).
        merged: Index of the younger kind, (R,).
    """
    state = _copy_kinds(state)
    _clear(state, rows, merged)
    of_merged = state["thing_kind"][rows] == merged[:, None, None]
    state["thing_kind"] = state["thing_kind"].copy()
    state["thing_kind"][rows] = np.where(of_merged, kept[:, None, None], state["thing_kind"][rows])
    kinds = state["specimen_kind"].copy()
    kinds[rows] = np.where(kinds[rows] == merged[:, None, None] + 1, kept[:, None, None] + 1, kinds[rows])
    # Two specimens of a thing may now have the same kinds; their holds are then combined.
    of_thing = state["specimen_thing"]
    if not of_thing.size:
        return state
    same = (of_thing[:, :, None] == of_thing[:, None]) & (kinds[:, :, None] == kinds[:, None]).all(axis=3)
    first = same.argmax(axis=2)
    holds = np.take_along_axis(first, state["hold_thing"], axis=1)
    is_first = (of_thing > 0) & (first == np.arange(first.shape[1]))
    return keep_specimens({**state, "specimen_kind": kinds, "hold_thing": holds}, is_first)


def close_gaps(state: State) -> State:
    """Moves each observer's kinds to the first places, and removes places that no observer uses."""
    is_kind = state["is_kind"]
    order = np.argsort(~is_kind, axis=1, kind="stable")
    rows, places = np.arange(len(order))[:, None], np.argsort(order, axis=1)
    order = order[:, : int(is_kind.sum(axis=1).max(initial=0))]
    closed = {name: state[name][rows, order] for name in OF_KINDS if name != "covariance"}
    closed["covariance"] = state["covariance"][rows[:, :, None], order[:, :, None], order[:, None, :]]
    kinds, specimens = state["thing_kind"], state["specimen_kind"]
    if places.shape[1]:
        kinds = places[rows[:, :, None], kinds]
        specimens = np.where(specimens > 0, places[rows[:, :, None], np.maximum(specimens - 1, 0)] + 1, 0)
    return {**state, **closed, "thing_kind": np.where(state["num_lifts"] > 0, kinds, 0), "specimen_kind": specimens}


def select_colours(state: State, colours: Sequence[int], things: Sequence[int]) -> State:
    """Selects colours and objects.

    Args:
        state: State of B observers.
        colours: Indices of the selected colours, which are renumbered in this order.
        things: Numbers of the selected objects, which must have no other colours.
    """
    places = np.zeros(state["is_own"].shape[1] + 1, dtype=np.intp)
    places[[thing + 1 for thing in things]] = np.arange(1, len(things) + 1)
    state = {**state, "specimen_thing": places[state["specimen_thing"]]}
    state = keep_specimens(state, state["specimen_thing"] > 0)
    state = {**state, **{name: state[name][:, list(things)] for name in OF_THINGS}}
    remains = mark_kinds(state, colours).any(axis=1)
    state = close_gaps(remove_kinds(state, state["is_kind"] & ~remains))
    numbers = np.zeros(max([*colours, -1]) + 1, dtype=np.intp)
    numbers[list(colours)] = np.arange(len(colours))
    return {**state, "kind_colour": np.where(state["is_kind"], numbers[state["kind_colour"]], 0)}


def _forget_own(state: State, is_odd: Mask) -> State:
    """Clears the own densities of objects that are not odd, given a mask ``is_odd``, (B, T, C)."""
    is_own = state["is_own"] & is_odd
    both = is_own[..., :, None] & is_own[..., None, :]
    own = {"own_mean": np.where(is_own, state["own_mean"], 0.0)}
    own["own_covariance"] = np.where(both, state["own_covariance"], 0.0)
    return {**state, **own, "is_own": is_own}


def _mark_same_colours(state: State) -> Mask:
    """Returns a mask of pairs of kinds with the same colour, (B, K, K)."""
    colour, is_kind = state["kind_colour"], state["is_kind"]
    same: Mask = (colour[:, :, None] == colour[:, None, :]) & is_kind[:, :, None] & is_kind[:, None, :]
    return same


def _copy_kinds(state: State) -> State:
    return {**state, **{name: state[name].copy() for name in OF_KINDS}}


def _clear(state: State, rows: NDArray[np.intp], kinds: NDArray[Any]) -> None:
    """Sets all entries of one kind to zero in each of the rows."""
    state["covariance"][rows, :, kinds] = 0.0
    for name in OF_KINDS:
        state[name][rows, kinds] = 0
