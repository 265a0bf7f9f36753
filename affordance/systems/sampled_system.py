"""Base of all our systems: sampled or algebraic, without continuous state."""

from pydrake.systems.framework import LeafSystem


class SampledSystem(LeafSystem):
    """A LeafSystem without continuous state, at no cost to the integrator.

    Drake asks every system of a Diagram for its time derivatives at every evaluation of an integrator, those without
    continuous state too, and for systems written in Python it first looks for an override. Its binding layer
    (nanobind, Drake 1.58) remembers that a method is not overridden only if there is an attribute of that name
    bound from C++; an attribute that does not exist is searched for anew each time, at 2.7 us a system and
    evaluation: with seven systems, more than the plant itself takes. So the attribute is made to exist. What it is
    bound to does not matter, as it is never called.
    """

    DoCalcTimeDerivatives = LeafSystem.AllocateContext
