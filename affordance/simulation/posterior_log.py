"""Log of the posterior during a trial; Drake's own logs accept only vectors."""

from typing import NamedTuple

from pydrake.systems.framework import Context

from affordance.belief.object_belief import ObjectBelief
from affordance.drake.sampled_system import ObjectParameter, SampledSystem, Source


class LoggedPosterior(NamedTuple):
    """Posterior given all samples before a time since the start of the trial, [s]; at 0 it is the visual prior."""

    time: float
    belief: ObjectBelief


class PosteriorLog(SampledSystem):
    """Log of the belief about the object, written by publish events, which precede updates at the same time.

    Each entry therefore reflects the samples before its time stamp. The last one, at the end of the presentation,
    reflects all samples: it is the posterior from which the memory learns.

    As for a VectorLogSink, the entries are stored in the Context, so that one Diagram serves any number of trials.
    They are a parameter, which every event replaces with a longer one.

    Input ports:
        posterior: Belief given the samples so far, ObjectBelief.
    """

    def __init__(self, period: float, duration: float) -> None:
        """Declares events at the start, every period, and at the end of a presentation; both arguments in [s]."""
        super().__init__()
        self._posterior: Source[ObjectBelief] = self.declare_object_input("posterior")
        # Entries so far, in order of time.
        self.entries: ObjectParameter[tuple[LoggedPosterior, ...]] = self.declare_object_parameter(())
        self.DeclareInitializationPublishEvent(self._log)
        # The first event is after one period, like the first sample: times that are summed differently would differ
        # by rounding.
        self.DeclarePeriodicPublishEvent(period, period, self._log)
        self.DeclarePeriodicPublishEvent(duration, duration, self._log)

    def _log(self, context: Context) -> None:
        entry = LoggedPosterior(context.get_time(), self._posterior.Eval(context))
        # If the integrator is changed during a trial, that time is published twice, and the last entry counts.
        earlier = [each for each in self.entries.get(context) if each.time < entry.time]
        self.entries.set(context, (*earlier, entry))
