"""Drake's renderer, which needs no screen but a library of the system."""

from pydrake.geometry import MakeRenderEngineVtk, RenderEngine, RenderEngineVtkParams

from affordance.exceptions import UnavailableError


def make_renderer(params: RenderEngineVtkParams) -> RenderEngine:
    """Makes the renderer.

    Raises:
        UnavailableError: Its library is missing.
    """
    try:
        return MakeRenderEngineVtk(params)
    except RuntimeError as error:
        raise UnavailableError("rendered pictures are", str(error)) from error
