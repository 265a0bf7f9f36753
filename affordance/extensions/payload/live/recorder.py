"""Records a stream as tables with descriptions that ``read_run`` reads."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import yaml

from affordance.arrays import Array
from affordance.extensions.payload.recording.run import Run
from affordance.extensions.payload.settings import SignalKind
from affordance.files.atomic import write_text

# Keys of a description that define the signal. The others apply to a single table.
_KEPT = ("tip", "base", "gravity", "compensates", "compensated_payload")


def describe(empty: Path | None, joints: Sequence[str], kind: SignalKind, tip: str) -> dict[str, Any]:
    """Builds the description of recorded tables, with the signal of an empty run and the arm's joints."""
    known: Mapping[str, Any] = {} if empty is None else yaml.safe_load(empty.read_text(encoding="utf-8"))
    kept = {key: known[key] for key in _KEPT if key in known}
    return {"joints": list(joints), "signal": kind.value, "tip": tip, **kept}


class Recorder:
    """Writes samples row by row, so that data survive if the program is killed."""

    def __init__(self, folder: Path, description: Mapping[str, Any]) -> None:
        """Creates the folder."""
        folder.mkdir(parents=True, exist_ok=True)
        self.folder, self._description = folder, description
        self._file: TextIO | None = None
        self.num_seen = self._num_final = 0

    def add(self, t: float, q: Array, v: Array | None, signal: Array) -> None:
        """Adds a sample to ``seen_N.csv``, unless it contains numbers that are not finite."""
        if not np.isfinite(np.concatenate([q, signal] if v is None else [q, v, signal])).all():
            return
        if self._file is None:
            self.num_seen += 1
            path = self._describe(f"seen_{self.num_seen}")
            self._file = path.open("w", encoding="utf-8")
            self._file.write(self._name_columns(len(q), v is not None))
        self._file.write(_format(t, q, v, signal))

    def cut(self) -> None:
        """Closes the table, before a gap or at the end."""
        if self._file is not None:
            self._file.close()
        self._file = None

    def write(self, run: Run) -> Path:
        """Writes the rows of a final answer to ``final_N.csv`` and returns its path."""
        self._num_final += 1
        path = self._describe(f"final_{self._num_final}")
        velocities = [None] * len(run.q) if run.v is None else run.v
        rows = zip(run.times, run.q, velocities, run.signal, strict=True)
        head = self._name_columns(run.q.shape[1], run.v is not None)
        write_text(path, head + "".join(_format(*row) for row in rows))
        return path

    def _describe(self, name: str) -> Path:
        path = self.folder / f"{name}.csv"
        write_text(path.with_suffix(".yaml"), yaml.safe_dump(dict(self._description), sort_keys=False))
        return path

    def _name_columns(self, num: int, has_v: bool) -> str:
        signal = "current" if self._description["signal"] == SignalKind.CURRENT.value else "tau"
        names = ("q", "v", signal) if has_v else ("q", signal)
        return ",".join(["time", *(f"{name}_{i + 1}" for name in names for i in range(num))]) + "\n"


def _format(t: float, q: Array, v: Array | None, signal: Array) -> str:
    row = np.concatenate([q, signal] if v is None else [q, v, signal])
    return ",".join([repr(float(t)), *(repr(float(x)) for x in row)]) + "\n"
