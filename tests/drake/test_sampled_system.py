"""Properties of the base class of all systems."""

import timeit

from pydrake.systems.framework import LeafSystem

from affordance.drake.sampled_system import SampledSystem


def build(base):
    """A system written in Python, its Context, and a vector for its time derivatives."""
    system = type("System", (base,), {})()
    context, derivatives = system.CreateDefaultContext(), system.AllocateTimeDerivatives()
    return system, context, derivatives


def test_derivatives_of_a_system_without_continuous_state_can_be_asked_for():
    """The placeholder method can be called by its C++ name, and writes derivatives of size 0."""
    system, context, derivatives = build(SampledSystem)
    system.DoCalcTimeDerivatives(context, derivatives)
    assert derivatives.size() == 0
    assert SampledSystem.DoCalcTimeDerivatives is LeafSystem.CalcTimeDerivatives


def test_no_override_is_searched_for_at_every_evaluation():
    """An evaluation takes less than half of a LeafSystem's time, by the least of 15 repeats; a hundredth is usual."""
    times = []
    for base in (SampledSystem, LeafSystem):
        system, context, derivatives = build(base)
        call = lambda s=system, c=context, d=derivatives: s.CalcTimeDerivatives(c, d)  # noqa: E731
        times.append(min(timeit.repeat(call, number=500, repeat=15)))
    assert times[0] < 0.5 * times[1]
