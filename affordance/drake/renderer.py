"""Drake's off-screen renderer, which needs a library of the system."""

from pydrake.geometry import MakeRenderEngineVtk, RenderEngine, RenderEngineVtkParams

from affordance.exceptions import UnavailableError


def make_renderer(params: RenderEngineVtkParams) -> RenderEngine:
    """Creates the renderer; a missing library of the system raises an UnavailableError."""
    try:
        return MakeRenderEngineVtk(params)
    except RuntimeError as error:
        raise UnavailableError("rendered pictures are", str(error)) from error
