"""``affordance identify``: identifies a robot's payload from recordings."""

import argparse
import importlib
from pathlib import Path

from affordance.files.model_folder import MODELS

# Nuisances that can be switched off, named as in the settings.
NUISANCES = ("gains", "load-friction", "friction", "tare", "floor", "correlated-noise")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add = parser.add_argument
    what = "folder that import-arm wrote, robot's file (URDF, SDF, MJCF), or .dmd.yaml"
    add("robot", nargs="?", type=Path, help=what)
    add("--robot", dest="robot_option", type=Path, metavar="ROBOT", help="the same, as other commands name it")
    add("--tip", help="link that carries the payload, or the wrist sensor (default: the run's description)")
    add("--base", help="link in which gravity is given (default: the run's description, or as far as joints go)")
    add("--loaded", type=Path, metavar="RUN", help="recording with the load (must be given)")
    add("--empty", type=Path, nargs="+", default=[], metavar="RUN", help="recordings with an empty hand")
    add(
        "--description",
        type=Path,
        help="YAML file that describes all runs (default: the file of the same name in the folder of each run)",
    )
    add("--unpaired", action="store_true", help="the loaded run repeats none of the empty ones")
    add(
        "--object", type=Path, help="tools file with what a camera saw of the object, its first tool or --object-name"
    )
    add("--object-name", help="which tool of that file")
    add(
        "--object-pose",
        type=float,
        nargs=6,
        metavar=("X", "Y", "Z", "ROLL", "PITCH", "YAW"),
        help="pose of the object in the tip, m and degrees (default: the run's description)",
    )
    add(
        "--size-error", type=float, default=0.2, metavar="SD", help="of the sizes of its parts, relative (default .2)"
    )
    add(
        "--unseen",
        type=float,
        default=0.2,
        metavar="SD",
        help="mass that the camera does not see, relative (default .2; .02 of solid stock)",
    )
    add("--materials", type=Path, default=MODELS / "materials.yaml", help="materials of that file")
    add(
        "--memory",
        metavar="MEMORY",
        help="lasting memory of materials, which learns from this run: SQLite file, new if there is none, or URL",
    )
    add("--learned", metavar="MEMORY", help="another memory that learns, with all that --memory knows")
    add("--reference-mass", type=float, metavar="KG", help="what the load weighs on a scale: finds gains of currents")
    add("--gains", type=Path, help="gains found before (gains.yaml of a run with --reference-mass)")
    add("--claimed", type=Path, metavar="FILE", help="payload that is set on the controller (docs/identify.md)")
    add("--tolerance", type=float, default=0.05, help="of its mass and centre of mass, relative (default .05)")
    add("--anyway", action="store_true", help="write, teach and print lines though the result is not to be trusted")
    add("--off", nargs="+", default=[], choices=NUISANCES, help="nuisances to leave out")
    add("--min-speed", type=float, help="leave out samples of a joint slower than this, rad/s (default 0.03)")
    add("--samples", type=int, default=32_000, help="of the posterior (default 32000)")
    add("--seed", type=int, default=0, help="of the samples (default 0)")
    add("--demo", action="store_true", help="identify a simulated recording that comes with the package")
    add("--out", type=Path, help="folder for belief.json, samples.nc, gains.yaml and figures (default: none)")
    add("--json", action="store_true", help="print the belief as JSON")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        dest="changes",
        metavar="NAME=VALUE",
        help="a setting of the prior, as prior.sd=8000; more than once",
    )


def run(arguments: argparse.Namespace) -> int:
    """Identifies the payload, prints and writes the result; returns 0, or 3 if it is not to be trusted."""
    # Imported on demand: it takes a second, for which --help need not wait.
    status: int = importlib.import_module("affordance.commands.identify_payload").run(arguments)
    return status
