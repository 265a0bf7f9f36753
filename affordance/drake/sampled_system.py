"""Base class of sampled or algebraic systems, with Python objects on their ports."""

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
    """Input port with a known type of value, which Drake's stubs declare as ``object``."""

    def Eval(self, context: Context, /) -> T:
        """Evaluates the port in a Context of its system."""


class Cached[T]:
    """Cache entry of a system.

    The reference to the system is weak. A system that stores Drake's own cache entry is never freed (Drake 1.58).
    """

    def __init__(self, system: LeafSystem, index: CacheIndex) -> None:
        """Stores a reference to a declared cache entry."""
        self._system = weakref.ref(system)
        self._index = index
        self.ticket = system.cache_entry_ticket(index)

    def get(self, context: Context) -> T:
        """Returns the value in a Context of the system. It is recomputed if a prerequisite has changed."""
        system: Any = self._system()
        return cast(T, system.get_cache_entry(self._index).Eval(context))


class ObjectParameter[T]:
    """Parameter of a system's Context whose value is a Python object."""

    def __init__(self, index: int, ticket: DependencyTicket) -> None:
        """Stores the index of a declared parameter, and its ticket for dependent quantities."""
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

    At every evaluation, Drake's integrator requests time derivatives from all systems, including those without
    continuous state. For a system written in Python, Drake first looks for an override of the method. Its binding
    layer (nanobind, Drake 1.58) caches a negative result only if an attribute of the same name is bound from C++.
    Otherwise it repeats the search, which takes 2.7 us per system and evaluation; for seven systems this is longer
    than the plant itself takes. Therefore this class defines the attribute. It refers to the public method with the
    same arguments, which returns the empty derivatives.
    """

    DoCalcTimeDerivatives = LeafSystem.CalcTimeDerivatives

    def declare_vector_input(self, name: str, size: int) -> Source[Array]:
        """Declares an input port for vectors."""
        return cast(Source[Array], self.DeclareVectorInputPort(name, size))

    def declare_object_input(self, name: str) -> Source[Any]:
        """Declares an input port for objects. Annotate the variable that stores the port with the objects' type."""
        return cast(Source[Any], self.DeclareAbstractInputPort(name, Value[object]()))

    def declare_object_output(
        self, name: str, calc: Callable[[Context], object], prerequisites: set[DependencyTicket]
    ) -> None:
        """Declares an output port whose value is the result of ``calc``, recomputed if a prerequisite changes."""
        self.DeclareAbstractOutputPort(name, Value[object], _make_setter(calc), prerequisites_of_calc=prerequisites)

    def declare_cached[T](
        self, name: str, calc: Callable[[Context], T], prerequisites: set[DependencyTicket]
    ) -> Cached[T]:
        """Declares a cache entry whose value is the result of ``calc``, recomputed if a prerequisite changes."""
        producer = ValueProducer(allocate=Value[object], calc=_make_setter(calc))
        return Cached(self, self.DeclareCacheEntry(name, producer, prerequisites).cache_index())

    def declare_object_parameter(self, initial: object = None) -> ObjectParameter[Any]:
        """Declares a parameter whose value is an object. Without an initial value, it must be set before use."""
        index = self.DeclareAbstractParameter(Value[object]() if initial is None else AbstractValue.Make(initial))
        return ObjectParameter(index, self.abstract_parameter_ticket(AbstractParameterIndex(index)))

    def input_ticket(self, name: str) -> DependencyTicket:
        """Returns the ticket of an input port, to declare it as a prerequisite."""
        return self.input_port_ticket(self.GetInputPort(name).get_index())


class ObjectSource[T](SampledSystem):
    """Source of a Python object. The object is a parameter of the Context, and must be set before use.

    The output port has the name that is given to the constructor.
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
    """Wraps a method for Drake. The reference is weak, so that the method's owner can be freed."""
    method: Any = weakref.WeakMethod(calc)

    def set_value(context: Any, output: Any) -> None:
        output.set_value(method()(context))

    return set_value
