"""Functions for states, which are arrays whose rows are observers: selecting and replacing rows, adding things."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.belief.likelihood import Likelihood

type State = dict[str, NDArray[Any]]

# Names of arrays in the state: precision, (B, T, C, C), and information vector, (B, T, C), of the summed likelihood
# of each of T things with at most C colours; zero for a thing that was never lifted.
FELT_PRECISION, FELT_INFORMATION = "felt_precision", "felt_information"


class Seen(NamedTuple):
    """Object that is seen, with the same m colours for all observers, and its number for each of them."""

    colours: tuple[int, ...]  # indices of its m colours
    things: NDArray[np.intp]  # number of the thing for each observer, from 0, (B,); it may never have been lifted


def take_rows(state: State, rows: NDArray[np.intp]) -> State:
    """Returns the state of some observers."""
    return {name: array[rows] for name, array in state.items()}


def put_rows(state: State, rows: NDArray[np.intp], part: State) -> State:
    """Returns the state with some rows replaced; arrays are padded with zeros if the new rows are longer."""
    merged = {}
    for name, new in part.items():
        shape = np.maximum(state[name].shape[1:], new.shape[1:])
        array = pad(state[name], shape).copy()
        array[rows] = pad(new, shape)
        merged[name] = array
    return {**state, **merged}


def pad(array: NDArray[Any], shape: Sequence[int] | NDArray[np.intp]) -> NDArray[Any]:
    """Pads each row of an array with zeros up to a shape, along dimensions where it is smaller."""
    size = tuple(max(int(wanted), there) for wanted, there in zip(shape, array.shape[1:], strict=True))
    if size == array.shape[1:]:
        return array
    padded = np.zeros((len(array), *size), dtype=array.dtype)
    padded[:, *(slice(each) for each in array.shape[1:])] = array
    return padded


def start_felt(size: int) -> State:
    """Returns the entries of a state for what is felt of things, without any thing yet."""
    return {FELT_PRECISION: np.zeros((size, 0, 0, 0)), FELT_INFORMATION: np.zeros((size, 0, 0))}


def make_room(state: State, names: Sequence[str], seen: Seen) -> State:
    """Returns the state with room for a thing and its colours in arrays of things, (B, T, C) or (B, T, C, C)."""
    room = (int(seen.things.max()) + 1, len(seen.colours), len(seen.colours))
    return {**state, **{name: pad(state[name], room[: state[name].ndim - 1]) for name in names}}


def get_felt(state: State, seen: Seen) -> Likelihood:
    """Returns the summed likelihood of a thing's m densities; zero if it was never lifted."""
    state = make_room(state, (FELT_PRECISION, FELT_INFORMATION), seen)
    rows, m = np.arange(len(seen.things)), len(seen.colours)
    precision = state[FELT_PRECISION][rows, seen.things, :m, :m]
    return Likelihood(precision, state[FELT_INFORMATION][rows, seen.things, :m], np.zeros(len(rows)))


def set_felt(state: State, seen: Seen, felt: Likelihood) -> State:
    """Returns the state with a new summed likelihood for a thing."""
    state = make_room(state, (FELT_PRECISION, FELT_INFORMATION), seen)
    precision, information = state[FELT_PRECISION].copy(), state[FELT_INFORMATION].copy()
    rows, m = np.arange(len(seen.things)), len(seen.colours)
    precision[rows, seen.things, :m, :m] = felt.precision
    information[rows, seen.things, :m] = felt.information_vector
    return {**state, FELT_PRECISION: precision, FELT_INFORMATION: information}
