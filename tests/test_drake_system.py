"""What all our systems share."""

import timeit

import pytest
from pydrake.systems.framework import LeafSystem

from affordance.drake_system import SampledSystem


def evaluate(base):
    """A system written in Python, and a function that asks it for its time derivatives as an integrator does."""
    system = type("System", (base,), {})()
    context, derivatives = system.CreateDefaultContext(), system.AllocateTimeDerivatives()
    return system, context, derivatives


def test_derivatives_of_a_system_without_continuous_state_can_be_asked_for():
    """By whoever calls the method that is only there to be found; a placeholder of other arguments would raise."""
    system, context, derivatives = evaluate(SampledSystem)
    system.DoCalcTimeDerivatives(context, derivatives)
    assert derivatives.size() == 0
    assert SampledSystem.DoCalcTimeDerivatives is LeafSystem.CalcTimeDerivatives


def test_no_override_is_searched_for_at_every_evaluation():
    """Without the attribute an evaluation takes a hundred times as long; the least of several turns is compared."""
    times = []
    for base in (SampledSystem, LeafSystem):
        system, context, derivatives = evaluate(base)
        call = lambda s=system, c=context, d=derivatives: s.CalcTimeDerivatives(c, d)  # noqa: E731
        times.append(min(timeit.repeat(call, number=500, repeat=15)))
    assert times[0] < 0.5 * times[1]


@pytest.mark.parametrize("base", [SampledSystem])
def test_method_is_bound_from_cpp(base):
    """Only such a one is remembered not to be an override."""
    assert type(base.__dict__["DoCalcTimeDerivatives"]) is type(LeafSystem.AllocateContext)
