"""What all our systems share."""

import timeit

from pydrake.systems.framework import LeafSystem

from affordance.drake.sampled_system import SampledSystem


def build(base):
    """A system written in Python, with a Context and what its time derivatives are written to."""
    system = type("System", (base,), {})()
    context, derivatives = system.CreateDefaultContext(), system.AllocateTimeDerivatives()
    return system, context, derivatives


def test_derivatives_of_a_system_without_continuous_state_can_be_asked_for():
    """By whoever calls the method that is only there to be found; a placeholder of other arguments would raise."""
    system, context, derivatives = build(SampledSystem)
    system.DoCalcTimeDerivatives(context, derivatives)
    assert derivatives.size() == 0
    assert SampledSystem.DoCalcTimeDerivatives is LeafSystem.CalcTimeDerivatives


def test_no_override_is_searched_for_at_every_evaluation():
    """Without the attribute an evaluation takes a hundred times as long; the least of several turns is compared."""
    times = []
    for base in (SampledSystem, LeafSystem):
        system, context, derivatives = build(base)
        call = lambda s=system, c=context, d=derivatives: s.CalcTimeDerivatives(c, d)  # noqa: E731
        times.append(min(timeit.repeat(call, number=500, repeat=15)))
    assert times[0] < 0.5 * times[1]


def test_method_is_bound_from_cpp():
    """Only such a one is remembered not to be an override."""
    assert type(SampledSystem.__dict__["DoCalcTimeDerivatives"]) is type(LeafSystem.AllocateContext)
