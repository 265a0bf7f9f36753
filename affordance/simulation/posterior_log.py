"""Drake system that logs the posterior during a trial. Drake's own logs only accept vectors."""

from typing import Any, NamedTuple, cast

from pydrake.common.value import Value
from pydrake.systems.framework import Context, ValueProducer

from affordance.belief.object_belief import ObjectBelief
from affordance.drake.sampled_system import SampledSystem, Source


class LoggedPosterior(NamedTuple):
    """Posterior given all samples before a time."""

    time: float  # time since the start of the trial, [s]
    belief: ObjectBelief  # posterior; at time zero, this is the visual prior


class PosteriorLog(SampledSystem):
    """Log of the belief about the object, which is written by periodic publish events.

    Each entry reflects the samples before its time stamp, because publish events precede updates at the same time. As
    in Drake's VectorLogSink, the log belongs to the Context: a cache entry to which publish events may write.

    Input ports:
        posterior: Belief given the samples so far, ObjectBelief.
    """

    def __init__(self, period: float) -> None:
        """Declares log entries at the start and once per period, [s]."""
        super().__init__()
        self._posterior: Source[ObjectBelief] = self.declare_object_input("posterior")
        producer = ValueProducer(allocate=lambda: Value[object]([]), calc=cast(Any, ValueProducer.NoopCalc))
        self._index = self.DeclareCacheEntry("log", producer, {self.nothing_ticket()}).cache_index()
        self.DeclareInitializationPublishEvent(self._log)
        # The first event is after one period, like the first sample, so that both have the same rounding errors in
        # time.
        self.DeclarePeriodicPublishEvent(period, period, self._log)

    def find_log(self, context: Context) -> list[LoggedPosterior]:
        """Returns the entries in order of time. The list must be cleared before a Context is used again."""
        entry: Any = self.get_cache_entry(self._index).get_mutable_cache_entry_value(context)
        return cast(list[LoggedPosterior], entry.GetMutableValueOrThrow())

    def _log(self, context: Context) -> None:
        log, entry = self.find_log(context), LoggedPosterior(context.get_time(), self._posterior.Eval(context))
        # If the integrator is changed during a trial, this time is published twice. The last entry is kept.
        if log and log[-1].time == entry.time:
            log.pop()
        log.append(entry)
