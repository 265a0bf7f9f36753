"""Interface of learners, which estimate material densities for many observers at once.

A learner object contains only parameters. The memory is a ``State``: named arrays with one row for each of B
observers or particles, so it can be stored and restored without loss. Rows are padded with zeros to the same length.
A robot arm is a single observer.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, NamedTuple, Protocol, Self, get_type_hints

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.holds import Felt
from affordance.belief.likelihood import Likelihood
from affordance.belief.normals import Normals
from affordance.belief.prior import Prior
from affordance.belief.rows import Seen as Seen
from affordance.belief.rows import State as State
from affordance.exceptions import AffordanceError, BadArgumentError
from affordance.files.constraints import check_fields


class Draws(Protocol):
    """Source of random numbers like ``numpy.random.Generator``. Row b of each array is for observer b."""

    def random(self, size: tuple[int, ...], /) -> Array:
        """Draws uniform numbers in [0, 1), with one row per observer."""

    def standard_normal(self, size: tuple[int, ...], /) -> Array:
        """Draws standard normal numbers, with one row per observer."""


class Lesson(NamedTuple):
    """State after a lift, and belief about the densities of the lifted object."""

    state: State
    densities: Normals  # posterior of the object's densities, (B, m)
    likelihood: Likelihood  # likelihood of these densities, one for each of B observers


class Groups(NamedTuple):
    """Groups of objects that share a mean density, up to K per observer.

    If a learner has one density per colour, each colour is one group.
    """

    means: Normals  # mean density of each group, (B, K)
    colours: NDArray[np.intp]  # index of the colour of each group, (B, K)
    common: NDArray[np.intp]  # index of each colour's most populous group, expected for new objects, (B, M)
    # For learners with several groups per colour: number of objects in each group, and prior mean and SD of its
    # density, (B, K) each. None for other learners.
    counts: NDArray[np.intp] | None = None
    prior_mean: Array | None = None
    prior_sd: Array | None = None


class Learner(ABC):
    """Base class of all learners, which update beliefs about material densities after lifts.

    A subclass declares its parameters as fields of a nested frozen dataclass ``Parameters``, such as
    ``rate: Annotated[float, Within(0.0, 1.0), Setting("1", "source")] = 0.1``. A parameter's value is one number for
    all observers, or a sequence with one number for each observer.

    Example:
        >>> from affordance import start_memory
        >>> from affordance.belief.kinds_learner import Kinds
        >>> start_memory(Kinds("map", kappa=0.3)).learner.parameters.kappa
        0.3
    """

    @dataclass(frozen=True)
    class Parameters:
        """Parameters of a learner without parameters."""

    def __init_subclass__(cls) -> None:
        """Resolves string annotations, which other processes cannot resolve without the defining file."""
        super().__init_subclass__()
        cls.Parameters.__annotations__ = get_type_hints(cls.Parameters, include_extras=True)

    def __init__(self, **parameters: Any) -> None:
        """Sets parameters by name.

        Raises:
            BadArgumentError: A name is unknown, or a value is invalid.
        """
        self.parameters: Any = _check_parameters(self, parameters)

    @property
    def name(self) -> str:
        """Name in files and on the command line."""
        return type(self).__name__

    @property
    def label(self) -> str:
        """Name in figures and tables."""
        return self.name

    @property
    def fitted(self) -> tuple[str, ...]:
        """Names of the parameters that are fitted to participants, by default all."""
        return tuple(_list_values(self.parameters))

    @property
    def is_exact(self) -> bool:
        """True if each colour has one density and the belief is the posterior given all holds."""
        return False

    def change(self, **parameters: Any) -> Self:
        """Returns a copy of the learner with new values for some parameters.

        Raises:
            BadArgumentError: A name is unknown, or a value is invalid.
        """
        return type(self)(**{**_list_values(self.parameters), **parameters})

    def of_observers(self, observers: Sequence[int]) -> Self:
        """Returns a copy of the learner with the parameters of selected observers."""
        values = _list_values(self.parameters)
        own = {name: each for name, each in values.items() if isinstance(each, tuple)}
        for name, each in own.items():
            if max(observers) >= len(each):
                problem = f"has {len(each)} values, must have at least {max(observers) + 1}, one for each observer"
                raise BadArgumentError("learner", name, problem)
        return self.change(**{name: tuple(each[i] for i in observers) for name, each in own.items()}) if own else self

    def __eq__(self, other: object) -> bool:
        """Returns True if class and parameters are equal."""
        return type(self) is type(other) and vars(self) == vars(other)

    def __hash__(self) -> int:
        return hash((type(self), tuple(vars(self).items())))

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={value!r}" for name, value in _list_values(self.parameters).items())
        return f"{self.name}({values})"

    def to_plain(self) -> Any:
        """Returns the learner as plain data for files: its name, with parameters unless all have default values."""
        return self.name if self == self.usual else {"name": self.name, **_list_values(self.parameters)}

    @property
    def usual(self) -> Self:
        """Copy of the learner with the default values of its parameters."""
        return type(self)()

    @abstractmethod
    def start(self, rng: Draws, parameters: Any, prior: Prior, num_colours: int, size: int) -> State:
        """Returns the initial state of B observers without experience.

        Args:
            rng: Random numbers, for learners with random initial states.
            parameters: ``Parameters`` of this learner.
            prior: Prior of materials that were never lifted; ``describe_start`` converts it to entries of a state.
            num_colours: Number M of known colours.
            size: Number of observers B.
        """

    @abstractmethod
    def believe(self, state: State) -> Normals:
        """Returns the belief about the mean density of new objects of each colour, (B, M)."""

    @abstractmethod
    def expect(self, state: State, seen: Seen) -> Normals:
        """Returns the belief about the m densities of a seen object before its lift, (B, m)."""

    @abstractmethod
    def learn(self, state: State, seen: Seen, felt: Felt, rng: Draws) -> Lesson:
        """Updates the state after a lift, and computes the belief about the object's densities.

        Args:
            state: State of the observers before the lift.
            seen: Lifted object.
            felt: Measurements of the lift; ``find_likelihood`` computes the likelihood of the object's densities.
            rng: Random numbers. Each discrete choice draws one uniform number per observer.
        """

    def meet(self, state: State, probabilities: Array) -> tuple[State, int]:
        """Adds a new colour to the state.

        Args:
            state: State of the observers.
            probabilities: Probabilities that the colour equals each of M known colours and, last, that it is new,
                (M + 1,).

        Returns:
            State with the new colour and its index M, or the unchanged state and the index of a known colour.
        """
        raise AffordanceError(f"{self.name} met a new colour after its start, which needs a method 'meet'")

    def select(self, state: State, colours: Sequence[int], things: Sequence[int]) -> State:
        """Selects colours and objects from the state.

        Args:
            state: State of the observers.
            colours: Indices of the selected colours, which are renumbered in this order.
            things: Numbers of the selected objects, which must have no other colours.
        """
        raise AffordanceError(f"{self.name} has to forget a colour, which needs a method 'select'")

    def group(self, state: State) -> Groups:
        """Returns the groups of objects with a common mean density, by default one per colour."""
        means = self.believe(state)
        colours = np.broadcast_to(np.arange(means.mean.shape[1]), means.mean.shape)
        return Groups(means, colours, colours)

    def find_groups(self, state: State, seen: Seen) -> NDArray[np.intp]:
        """Returns the object's group for each of its m colours, (B, m)."""
        return np.broadcast_to(np.array(seen.colours, dtype=np.intp), (len(seen.things), len(seen.colours)))


def describe_start(parameters: Any, prior: Prior, size: int) -> State:
    """Converts the prior and a learner's parameters to entries of a state, (B,) each."""
    return {**describe_prior(prior, size), **{name: np.full(size, v) for name, v in _list_values(parameters).items()}}


def describe_prior(prior: Prior, size: int) -> State:
    """Converts the prior to entries of a state, (B,) each."""
    values = {"prior_mode": prior.mode, "prior_sd": prior.sd, "deviation": prior.deviation}
    return {name: np.full(size, value) for name, value in values.items()}


def _check_parameters(learner: Learner, given: Mapping[str, Any]) -> Any:
    kind = learner.Parameters
    if not is_dataclass(kind):
        raise BadArgumentError(learner.name, "Parameters", "is not a dataclass, must be a frozen dataclass")
    parameters: Any = kind()
    for name, value in given.items():
        if name not in _list_values(parameters):
            known = ", ".join(_list_values(parameters)) or "none"
            raise BadArgumentError(learner.name, name, f"is not a parameter; known are {known}")
        several = isinstance(value, np.ndarray | list | tuple)
        checked = tuple(_check_value(kind, name, each) for each in (value if several else [value]))
        parameters = replace(parameters, **{name: checked if several else checked[0]})
    return parameters


def _check_value(kind: Any, name: str, value: Any) -> Any:
    checked = kind(**{name: value})
    check_fields(checked)
    return getattr(checked, name)


def _list_values(parameters: Any) -> dict[str, Any]:
    return {each.name: getattr(parameters, each.name) for each in fields(parameters)}
