"""What every experiment leaves behind (design 7)."""

import json

import numpy as np

COMMON = {"seed": (), "repeats": (), "run_shown": (), "wall_s": ()}


def check_results(folder, contract, figures):
    """Asserts that figures, trajectories, diagram, replay and numbers are there; returns the numbers.

    ``contract`` gives the shape of each number by its key.
    """
    for name in (*figures, "diagram"):
        assert (folder / f"{name}.svg").stat().st_size > 1000
        assert name == "diagram" or (folder / f"{name}.png").stat().st_size > 1000
    assert (folder / "diagram.dot").stat().st_size > 1000
    assert (folder / "replay.html").stat().st_size > 1e6
    assert (folder / "trajectories.nc").exists()
    numbers = json.loads((folder / "metrics.json").read_text())
    for key, shape in {**contract, **COMMON}.items():
        assert np.shape(numbers[key]) == shape, key
        assert np.isfinite(numbers[key]).all(), key
    return numbers
