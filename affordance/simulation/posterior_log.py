"""Log of the posterior during a trial. Drake's own logs accept only vectors."""

from typing import Any, NamedTuple, cast

from pydrake.common.value import Value
from pydrake.systems.framework import Context, ValueProducer

from affordance.belief.object_belief import ObjectBelief
from affordance.drake.sampled_system import SampledSystem, Source


class LoggedPosterior(NamedTuple):
    """Posterior from all samples before a time, [s].

    The time is relative to the start of the trial, where the posterior is the visual prior.
    """

    time: float
    belief: ObjectBelief


class PosteriorLog(SampledSystem):
    """Log of the belief about the object, written by publish events. Publish events precede updates at the same time.

    Each entry therefore reflects the samples before its time stamp. As in Drake's VectorLogSink, the log belongs to
    the Context. It is a cache entry without computation, so publish events may write to it.

    Input ports:
        posterior: Belief given the samples so far, ObjectBelief.
    """

    def __init__(self, period: float) -> None:
        """Declares an entry at the start, and one every period, [s]."""
        super().__init__()
        self._posterior: Source[ObjectBelief] = self.declare_object_input("posterior")
        producer = ValueProducer(allocate=lambda: Value[object]([]), calc=cast(Any, ValueProducer.NoopCalc))
        self._index = self.DeclareCacheEntry("log", producer, {self.nothing_ticket()}).cache_index()
        self.DeclareInitializationPublishEvent(self._log)
        # The first event is after one period, like the first sample: times that are summed differently would differ
        # by rounding.
        self.DeclarePeriodicPublishEvent(period, period, self._log)

    def find_log(self, context: Context) -> list[LoggedPosterior]:
        """Returns the entries in order of time. Clear the list before a Context is used again."""
        entry: Any = self.get_cache_entry(self._index).get_mutable_cache_entry_value(context)
        return cast(list[LoggedPosterior], entry.GetMutableValueOrThrow())

    def _log(self, context: Context) -> None:
        log, entry = self.find_log(context), LoggedPosterior(context.get_time(), self._posterior.Eval(context))
        # If the integrator is changed during a trial, that time is published twice, and the last entry counts.
        if log and log[-1].time == entry.time:
            log.pop()
        log.append(entry)
