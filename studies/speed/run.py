"""Runs all comparative measurements, one after the other, and writes results/benchmarks/: ``make bench``."""

import os

# One thread each, as in the experiments' processes; it must be set before NumPy is loaded.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import importlib.metadata
from pathlib import Path

from affordance.files.atomic import write_json, write_text
from affordance.runs.repeats import list_versions
from studies.speed import closed_loop, decision, mpc_tick, regressor, strike
from studies.study import format_table

FOLDER = Path("results/benchmarks")
PEERS = ("pin",)
HOW = {
    "loop_vs_cpp_hold": "wall time of the same plant under a C++ hold over that of the closed loop, all five trials",
    "loop_realtime_factor": "simulated seconds of the closed loop per second of wall time on one core",
    "mpc_tick_vs_algebra": "time of a tick, no limit active, over that of the closed form factorised at every tick",
    "mpc_tick_vs_kept_algebra": "the same over the closed form with its inverse kept, one matrix product",
    "mpc_tick_vs_drake_solver": "the same over the plan alone by Drake's equality-constrained solver, program kept",
    "mpc_limits_vs_osqp": "time of a tick with limits active over that of OSQP at 1e-6 on a kept program",
    "regressor_vs_pinocchio": "time for 300 samples over that of Pinocchio's C++ regressor in a loop",
    "decisions_vs_rollouts": "choices of a grip for reaching per second by inner simulation, 10,000 with their "
    "planning, over those by simulating both grips",
    "decisions_vs_blows": "the same for hammering, contact simulated",
    "strike_wall_s": "seconds that one core takes for the 55 ms in which tool and nail may touch, median of 24 blows",
}


def main() -> None:
    """Runs all measurements, prints the tables, and writes them with the ratios."""
    tables, ratios = [], {}
    for module in (closed_loop, mpc_tick, regressor, decision, strike):
        rows, found = module.measure()
        tables.append(format_table(module.HEADER, rows))
        ratios.update(found)
        print(tables[-1], flush=True)
    summary = format_table(
        ["ratio", "value", "what it is"], [[name, f"{value:.3g}", HOW[name]] for name, value in ratios.items()]
    )
    versions = {**list_versions(), **{name: importlib.metadata.version(name) for name in PEERS}}
    measured_with = ", ".join(f"{name} {version}" for name, version in versions.items())
    print(f"{summary}\n\n{measured_with}")
    write_text(FOLDER / "tables.md", "\n\n".join([summary, measured_with, *tables]) + "\n")
    write_json(FOLDER / "metrics.json", {**ratios, "how": HOW, "versions": versions})


if __name__ == "__main__":
    main()
