"""``affordance doctor``: checks which parts of the program work on this machine."""

import argparse
import importlib
import importlib.metadata
import importlib.util
import json
import logging
import platform
from collections.abc import Callable

from affordance.drake.system_libraries import find_missing, hide_font_warnings, provide_libraries, write_command
from affordance.exceptions import AffordanceError
from affordance.files.model_folder import MODELS
from affordance.version import __version__

# Optional extras for users, each with a module that it installs and its purpose.
EXTRAS = {
    "bags": ("rosbags", "reads ROS bags"),
    "parquet": ("pyarrow", "reads Parquet and LeRobot recordings"),
    "dds": ("cyclonedds", "reads joint states of ROS 2, without ROS"),
    "people": ("arviz", "summarises fits to people"),
    "tutorials": ("jupyterlab", "opens the tutorials as notebooks"),
    "mjcf": ("mujoco", "reads MJCF models of robots"),
    "xacro": ("xacrodoc", "reads xacro templates"),
    "film": ("imageio_ffmpeg", "writes films as WebM and MP4"),
}


def run(arguments: argparse.Namespace) -> int:
    """Prints one line per part, and returns the exit status: 0 if all required parts work, else 2."""
    if arguments.install:
        provide_libraries(arguments.tests)
    missing = find_missing(arguments.tests)
    checks: dict[str, Callable[[], str]] = {
        "drake": _check_drake,
        "solvers": _check_solvers,
        "renderer": _check_renderer,
        "graphviz": _check_graphviz,
        "meshcat": _check_meshcat,
    }
    found: dict[str, tuple[bool, str]] = {}

    def tell(name: str, works: bool, line: str) -> None:
        found[name] = works, line
        if not arguments.json:
            print(f"{name:<11} {line}", flush=True)

    tell("affordance", True, f"{__version__}, Python {platform.python_version()}, {platform.machine()}")
    tell("libraries", not missing, f"missing; run: sudo {write_command(missing)}" if missing else "all found")
    for name, check in checks.items():
        tell(name, *_try(check))
    has_models = (MODELS / "arm.sdf").exists()
    tell("models", has_models, str(MODELS) if has_models else f"missing: {MODELS}")
    for extra, (module, purpose) in EXTRAS.items():
        is_there = importlib.util.find_spec(module) is not None
        how = f"not installed ({purpose}); to install: pip install '.[{extra}]' in a clone"
        tell(f"[{extra}]", is_there, f"installed ({purpose})" if is_there else how)
    if arguments.json:
        print(
            json.dumps({name: {"works": works, "message": line} for name, (works, line) in found.items()}, indent=2)
        )
    return 0 if found["drake"][0] and found["solvers"][0] else 2


def _try(check: Callable[[], str]) -> tuple[bool, str]:
    """Runs a check, and returns its success and message."""
    try:
        return True, check()
    except (ImportError, AffordanceError, RuntimeError, OSError, MemoryError) as error:
        return False, f"does not work: {' '.join(str(error).split()) or type(error).__name__}"


def _check_drake() -> str:
    importlib.import_module("pydrake.multibody.plant")
    logging.getLogger("drake").setLevel(logging.WARNING)  # Meshcat announces its port
    return f"works, version {importlib.metadata.version('drake')}"


def _check_solvers() -> str:
    solvers = importlib.import_module("pydrake.solvers")
    names = ("Daqp", "Clarabel", "Snopt")
    lacking = [name for name in names if not getattr(solvers, f"{name}Solver")().available()]
    if lacking:
        raise AffordanceError(f"this build of Drake lacks {', '.join(lacking)}")
    return f"{', '.join(names)} work"


def _check_renderer() -> str:
    from affordance.extensions.pixels.pixel_eye import check_renderer  # imported here: it needs Drake

    return check_renderer()


def _check_graphviz() -> str:
    graphviz = importlib.import_module("pygraphviz")
    with hide_font_warnings():
        graphviz.AGraph("digraph { a -> b }").draw(format="svg", prog="dot")
    return "works"


def _check_meshcat() -> str:
    geometry = importlib.import_module("pydrake.geometry")
    meshcat = geometry.Meshcat(geometry.MeshcatParams(host="localhost"))
    port = meshcat.port()
    del meshcat
    return f"works, port {port}"
