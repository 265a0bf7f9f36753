"""Drake's off-screen renderer, which needs a library of the system."""

from pydrake.geometry import MakeRenderEngineVtk, RenderEngine, RenderEngineVtkParams

from affordance.exceptions import UnavailableError


def make_renderer(params: RenderEngineVtkParams) -> RenderEngine:
    """Creates the renderer.

    Raises:
        UnavailableError: A library of the renderer is missing.
    """
    try:
        return MakeRenderEngineVtk(params)
    except RuntimeError as error:
        raise UnavailableError("rendered pictures are", str(error)) from error
