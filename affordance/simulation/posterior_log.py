"""Log of the posterior during a trial; Drake's own logs take vectors only."""

from typing import NamedTuple

from pydrake.systems.framework import Context

from affordance.belief.object_belief import ObjectBelief
from affordance.drake.sampled_system import ObjectParameter, SampledSystem, Source


class LoggedPosterior(NamedTuple):
    """Posterior given every sample before a time since the beginning of the trial, [s]; at 0 the visual prior."""

    time: float
    belief: ObjectBelief


class PosteriorLog(SampledSystem):
    """Log of the belief about the object, written by publish events, which precede the updates of their time.

    An entry therefore does not include the sample taken at its own time. The last one, at the end of the
    presentation, includes all: it is the posterior that the memory takes over.

    As with a VectorLogSink the entries lie in the Context, so that one Diagram serves any number of trials. They are
    a parameter, which each event replaces by a longer one.

    Input ports:
        posterior: Belief given the samples so far, ObjectBelief.
    """

    def __init__(self, period: float, duration: float) -> None:
        """Declares events at the beginning, every period, and at the end of a presentation; both arguments in [s]."""
        super().__init__()
        self._posterior: Source[ObjectBelief] = self.declare_object_input("posterior")
        # Entries so far, in the order of time.
        self.entries: ObjectParameter[tuple[LoggedPosterior, ...]] = self.declare_object_parameter(())
        self.DeclareInitializationPublishEvent(self._log)
        # Starting at the first period, as the samples do: times that are summed differently differ by rounding.
        self.DeclarePeriodicPublishEvent(period, period, self._log)
        self.DeclarePeriodicPublishEvent(duration, duration, self._log)

    def _log(self, context: Context) -> None:
        entry = LoggedPosterior(context.get_time(), self._posterior.Eval(context))
        # A change of the integrator during a trial publishes that moment twice: the last entry counts.
        earlier = [each for each in self.entries.get(context) if each.time < entry.time]
        self.entries.set(context, (*earlier, entry))
