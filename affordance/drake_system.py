"""Base of all our systems: sampled or algebraic, without continuous state, with ports that carry Python objects."""

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
    """An input port whose values are of a known type; Drake's own stubs say ``object``."""

    def Eval(self, context: Context, /) -> T:
        """Evaluates it in a Context of its system."""


class Cached[T]:
    """A cache entry of a system.

    It refers to its system weakly: a system that holds an entry of Drake's own is never freed (Drake 1.58).
    """

    def __init__(self, system: LeafSystem, index: CacheIndex) -> None:
        """Refers to a declared cache entry."""
        self._system = weakref.ref(system)
        self._index = index
        self.ticket = system.cache_entry_ticket(index)

    def get(self, context: Context) -> T:
        """Returns the value in a Context of the system, computed anew only if a prerequisite has changed."""
        system: Any = self._system()
        return cast(T, system.get_cache_entry(self._index).Eval(context))


class ObjectParameter[T]:
    """A parameter of a system's Context that is a Python object."""

    def __init__(self, index: int, ticket: DependencyTicket) -> None:
        """Refers to a declared parameter; ticket is for what depends on it."""
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
    """A LeafSystem without continuous state, at no cost to the integrator.

    Drake asks every system of a Diagram for its time derivatives at every evaluation of an integrator, those without
    continuous state too, and for systems written in Python it first looks for an override. Its binding layer
    (nanobind, Drake 1.58) remembers that a method is not overridden only if there is an attribute of that name
    bound from C++; an attribute that does not exist is searched for anew each time, at 2.7 us a system and
    evaluation: with seven systems, more than the plant itself takes. So the attribute is made to exist. It is
    bound to the public method of the same arguments: whoever calls it gets the derivatives, of which there are none.
    """

    DoCalcTimeDerivatives = LeafSystem.CalcTimeDerivatives

    def declare_vector_input(self, name: str, size: int) -> Source[Array]:
        """Declares an input port for vectors."""
        return cast(Source[Array], self.DeclareVectorInputPort(name, size))

    def declare_object_input(self, name: str) -> Source[Any]:
        """Declares an input port for objects; annotate what it is assigned to with their type."""
        return cast(Source[Any], self.DeclareAbstractInputPort(name, Value[object]()))

    def declare_object_output(
        self, name: str, calc: Callable[[Context], object], prerequisites: set[DependencyTicket]
    ) -> None:
        """Declares an output port for the object that ``calc`` returns, recomputed when a prerequisite changes."""
        self.DeclareAbstractOutputPort(name, Value[object], _make_setter(calc), prerequisites_of_calc=prerequisites)

    def declare_cached[T](
        self, name: str, calc: Callable[[Context], T], prerequisites: set[DependencyTicket]
    ) -> Cached[T]:
        """Declares a cache entry for the object that ``calc`` returns, recomputed when a prerequisite changes."""
        producer = ValueProducer(allocate=Value[object], calc=_make_setter(calc))
        return Cached(self, self.DeclareCacheEntry(name, producer, prerequisites).cache_index())

    def declare_object_parameter(self, initial: object = None) -> ObjectParameter[Any]:
        """Declares a parameter of the Context that is an object; without initial it must be set before it is read."""
        index = self.DeclareAbstractParameter(Value[object]() if initial is None else AbstractValue.Make(initial))
        return ObjectParameter(index, self.abstract_parameter_ticket(AbstractParameterIndex(index)))

    def input_ticket(self, name: str) -> DependencyTicket:
        """The ticket for what depends on an input port."""
        return self.input_port_ticket(self.GetInputPort(name).get_index())


def _make_setter(calc: Callable[[Context], object]) -> Callable[[object, object], None]:
    """Makes of a method what Drake calls for objects; weakly, as Drake would keep the method's owner for ever."""
    method: Any = weakref.WeakMethod(calc)

    def set_value(context: Any, output: Any) -> None:
        output.set_value(method()(context))

    return set_value
