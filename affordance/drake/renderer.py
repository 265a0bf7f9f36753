"""Creates Drake's off-screen renderer, which needs a system library."""

import math
import resource
from pathlib import Path

from pydrake.geometry import MakeRenderEngineVtk, RenderEngine, RenderEngineVtkParams

from affordance.exceptions import UnavailableError

# Address space required by the renderer, [bytes]. It uses 0.65 GB, and the process crashes if there is less.
_NEEDED = 1_000_000_000


def make_renderer(params: RenderEngineVtkParams) -> RenderEngine:
    """Creates Drake's renderer.

    Raises:
        UnavailableError: A system library is missing, or there is too little memory.
    """
    room = _find_room()
    if room < _NEEDED:
        problem = f"{room / 1e9:.2f} GB of address space are left, must be at least {_NEEDED / 1e9:g} GB"
        raise UnavailableError("rendered pictures are", problem)
    try:
        return MakeRenderEngineVtk(params)
    except RuntimeError as error:
        raise UnavailableError("rendered pictures are", str(error)) from error


def _find_room() -> float:
    """Computes the address space that remains for this process, [bytes]; infinite if unlimited or unknown."""
    most, _ = resource.getrlimit(resource.RLIMIT_AS)
    sizes = Path("/proc/self/statm")  # on Linux
    if most == resource.RLIM_INFINITY or not sizes.exists():
        return math.inf
    return most - int(sizes.read_text(encoding="ascii").split()[0]) * resource.getpagesize()
