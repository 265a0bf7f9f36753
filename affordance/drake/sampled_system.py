"""Base class for systems without continuous state, with Python objects on ports.

The systems are sampled or algebraic.
"""

import weakref
from collections.abc import Callable
from typing import Any, Protocol, cast

from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import (
    AbstractParameterIndex,
    CacheIndex,
    Context,
    DependencyTicket,
    LeafSystem,
    ValueProducer,
)

from affordance.arrays import Array


class Source[T](Protocol):
    """Input port with values of a known type; Drake's stubs declare ``object``."""

    def Eval(self, context: Context, /) -> T:
        """Evaluates the port in a Context of its system."""


class Cached[T]:
    """Cache entry of a system.

    The reference to the system is weak, because a system that holds Drake's own cache entry is never freed (Drake
    1.58).
    """

    def __init__(self, system: LeafSystem, index: CacheIndex) -> None:
        """Stores a reference to a declared cache entry."""
        self._system = weakref.ref(system)
        self._index = index
        self.ticket = system.cache_entry_ticket(index)

    def get(self, context: Context) -> T:
        """Returns the value in a Context of the system.

        The value is recomputed only if a prerequisite has changed.
        """
        system: Any = self._system()
        return cast(T, system.get_cache_entry(self._index).Eval(context))


class ObjectParameter[T]:
    """Parameter of a system's Context that is a Python object."""

    def __init__(self, index: int, ticket: DependencyTicket) -> None:
        """Stores the index of a declared parameter, and its ticket for dependants."""
        self._index = index
        self.ticket = ticket

    def get(self, context: Context) -> T:
        """Returns the object in a Context of the system."""
        value: Any = context.get_abstract_parameter(self._index)
        return cast(T, value.get_value())

    def set(self, context: Context, value: T) -> None:
        """Sets the object in a Context of the system."""
        context.get_mutable_abstract_parameter(self._index).set_value(value)


class SampledSystem(LeafSystem):
    """LeafSystem without continuous state that does not slow down the integrator.

    At every evaluation of an integrator, Drake requests the time derivatives of all systems of a Diagram, even those
    without continuous state. For systems written in Python it first looks for an override. Its binding layer
    (nanobind, Drake 1.58) remembers that a method is not overridden only if an attribute of that name is bound from
    C++. A missing attribute is searched for each time, at 2.7 us per system and evaluation; with seven systems, this
    takes longer than the plant itself. Therefore the attribute is defined here. It is bound to the public method with
    the same arguments, so callers get the derivatives, which are empty.
    """

    DoCalcTimeDerivatives = LeafSystem.CalcTimeDerivatives

    def declare_vector_input(self, name: str, size: int) -> Source[Array]:
        """Declares an input port for vectors."""
        return cast(Source[Array], self.DeclareVectorInputPort(name, size))

    def declare_object_input(self, name: str) -> Source[Any]:
        """Declares an input port for objects. Annotate the variable that holds the port with their type."""
        return cast(Source[Any], self.DeclareAbstractInputPort(name, Value[object]()))

    def declare_object_output(
        self, name: str, calc: Callable[[Context], object], prerequisites: set[DependencyTicket]
    ) -> None:
        """Declares an output port for the object that ``calc`` returns.

        The object is recomputed if a prerequisite changes.
        """
        self.DeclareAbstractOutputPort(name, Value[object], _make_setter(calc), prerequisites_of_calc=prerequisites)

    def declare_cached[T](
        self, name: str, calc: Callable[[Context], T], prerequisites: set[DependencyTicket]
    ) -> Cached[T]:
        """Declares a cache entry for the object that ``calc`` returns.

        The object is recomputed if a prerequisite changes.
        """
        producer = ValueProducer(allocate=Value[object], calc=_make_setter(calc))
        return Cached(self, self.DeclareCacheEntry(name, producer, prerequisites).cache_index())

    def declare_object_parameter(self, initial: object = None) -> ObjectParameter[Any]:
        """Declares an object parameter of the Context. Without an initial value, it must be set before use."""
        index = self.DeclareAbstractParameter(Value[object]() if initial is None else AbstractValue.Make(initial))
        return ObjectParameter(index, self.abstract_parameter_ticket(AbstractParameterIndex(index)))

    def input_ticket(self, name: str) -> DependencyTicket:
        """Returns the ticket of an input port, for dependants."""
        return self.input_port_ticket(self.GetInputPort(name).get_index())


class ObjectSource[T](SampledSystem):
    """Source of a Python object, which is a parameter of the Context. The object must be set before use.

    Output ports: the object, named by the constructor's argument.
    """

    def __init__(self, name: str) -> None:
        """Declares the output port."""
        super().__init__()
        self._value: ObjectParameter[T] = self.declare_object_parameter()
        self.declare_object_output(name, self._value.get, {self._value.ticket})

    def get(self, context: Context) -> T:
        """Returns the object in a Context of this system."""
        return self._value.get(context)

    def set(self, context: Context, value: T) -> None:
        """Sets the object in a Context of this system."""
        self._value.set(context, value)


def _make_setter(calc: Callable[[Context], object]) -> Callable[[object, object], None]:
    """Wraps a method in the form that Drake calls. The reference is weak so that its owner can be freed."""
    method: Any = weakref.WeakMethod(calc)

    def set_value(context: Any, output: Any) -> None:
        output.set_value(method()(context))

    return set_value
