"""Operations on states: named arrays with one row per observer."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

type State = dict[str, NDArray[Any]]


class Seen(NamedTuple):
    """Seen object with m colours, which are the same for all observers."""

    colours: tuple[int, ...]  # indices of the m colours
    things: NDArray[np.intp]  # number of the object for each observer, from 0, (B,); it may never have been lifted


def take_rows(state: State, rows: NDArray[np.intp]) -> State:
    """Selects observers."""
    return {name: array[rows] for name, array in state.items()}


def put_rows(state: State, rows: NDArray[np.intp], part: State) -> State:
    """Replaces the state of selected observers. Shorter rows are padded with zeros."""
    merged = {}
    for name, new in part.items():
        shape = np.maximum(state[name].shape[1:], new.shape[1:])
        array = pad(state[name], shape).copy()
        array[rows] = pad(new, shape)
        merged[name] = array
    return {**state, **merged}


def pad(array: NDArray[Any], shape: Sequence[int] | NDArray[np.intp]) -> NDArray[Any]:
    """Pads each row with zeros to at least a given shape."""
    size = tuple(max(int(wanted), there) for wanted, there in zip(shape, array.shape[1:], strict=True))
    if size == array.shape[1:]:
        return array
    padded = np.zeros((len(array), *size), dtype=array.dtype)
    padded[:, *(slice(each) for each in array.shape[1:])] = array
    return padded


def make_room(state: State, names: Sequence[str], seen: Seen) -> State:
    """Enlarges arrays of objects, (B, T, C) or (B, T, C, C), so that they have room for an object."""
    room = (int(seen.things.max()) + 1, len(seen.colours), len(seen.colours))
    return {**state, **{name: pad(state[name], room[: state[name].ndim - 1]) for name in names}}
