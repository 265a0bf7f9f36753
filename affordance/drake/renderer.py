"""Drake's off-screen renderer, which needs a library of the system."""

import math
import resource
from pathlib import Path

from pydrake.geometry import MakeRenderEngineVtk, RenderEngine, RenderEngineVtkParams

from affordance.exceptions import UnavailableError

# Address space that the renderer must find: it takes 0.65 GB, and crashes the process without it, [bytes].
_NEEDED = 1_000_000_000


def make_renderer(params: RenderEngineVtkParams) -> RenderEngine:
    """Creates the renderer; a missing library of the system, or a lack of memory, raises an UnavailableError."""
    room = _find_room()
    if room < _NEEDED:
        problem = f"{room / 1e9:.2f} GB of the address space are left, must be at least {_NEEDED / 1e9:g} GB"
        raise UnavailableError("rendered pictures are", problem)
    try:
        return MakeRenderEngineVtk(params)
    except RuntimeError as error:
        raise UnavailableError("rendered pictures are", str(error)) from error


def _find_room() -> float:
    """Finds how much address space is left to this process, [bytes]; infinite without a limit, or where unknown."""
    most, _ = resource.getrlimit(resource.RLIMIT_AS)
    sizes = Path("/proc/self/statm")  # of Linux
    if most == resource.RLIM_INFINITY or not sizes.exists():
        return math.inf
    return most - int(sizes.read_text(encoding="ascii").split()[0]) * resource.getpagesize()
