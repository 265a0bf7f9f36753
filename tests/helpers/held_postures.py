"""Tables of held postures, of a wrist sensor or of joint torques."""

from pathlib import Path

import numpy as np

from affordance.arrays import Array

_OF_WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")


def write_table(
    path: Path, q: Array, signal: Array, *, is_wrench: bool, more: str = "", time: Array | None = None
) -> Path:
    """Writes a table and its description, which has some more lines."""
    n = q.shape[1]
    of_signal = _OF_WRENCH if is_wrench else [f"tau_{i + 1}" for i in range(n)]
    names = [*([] if time is None else ["time"]), *(f"q_{i + 1}" for i in range(n)), *of_signal]
    values = np.hstack([*([] if time is None else [time[:, None]]), q, signal])
    np.savetxt(path, values, delimiter=",", fmt="%.6f", header=",".join(names), comments="")
    joints = ", ".join(f"joint_{i + 1}" for i in range(n))
    kind = "wrench" if is_wrench else "joint_torque"
    path.with_suffix(".yaml").write_text(f"joints: [{joints}]\nsignal: {kind}\ntip: flange\n{more}")
    return path
