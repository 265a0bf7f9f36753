"""Stamps of a stream: used as they are, or smoothed if they overtake each other, which times of samples cannot."""

from collections.abc import Iterator

import numpy as np

_FIRST = 50  # samples from which it is decided
_OVERTAKEN = 0.05  # share of stamps before those of the sample before, from which stamps are smoothed
_HALF = 15  # samples on either side over which stamps are averaged


class Stamps[T]:
    """Gives samples their times.

    Jitter of some milliseconds makes angles rough, and accelerations useless where velocities are missing. A moving
    average of the stamps, in the order of arrival, leaves a smooth error of a fifth of it, as drivers sample evenly.
    A lost sample shifts its neighbours by half a step at most.
    """

    def __init__(self) -> None:
        """Begins a stream."""
        self._waiting: list[tuple[float, T]] = []
        self.overtake: bool | None = None  # None until it is decided

    def put(self, t: float, sample: T) -> Iterator[tuple[float, T]]:
        """Takes a sample with its stamp, [s], and gives those whose times are known."""
        if self.overtake is False:
            yield t, sample
            return
        self._waiting.append((t, sample))
        if self.overtake is None:
            if len(self._waiting) < _FIRST:
                return
            steps = np.diff([stamp for stamp, _ in self._waiting])
            self.overtake = bool(np.mean(steps < 0.0) > _OVERTAKEN)
            if not self.overtake:
                yield from self._waiting
                self._waiting = []
        while self.overtake and len(self._waiting) > 2 * _HALF:
            window = self._waiting[: 2 * _HALF + 1]
            yield sum(stamp for stamp, _ in window) / len(window), window[_HALF][1]
            del self._waiting[0]
