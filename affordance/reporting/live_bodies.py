"""Bodies of successive Diagrams in one Meshcat; what is shown already and unchanged is not sent again."""

from typing import Any, cast

from pydrake.common.value import Value
from pydrake.geometry import FrameId, Mesh, Meshcat, QueryObject, Rgba, Role, SceneGraphInspector, Shape
from pydrake.systems.framework import Context

from affordance.drake.sampled_system import SampledSystem, Source

_PREFIX = "arm"
# Colour of a shape that has none.
_GREY = Rgba(0.9, 0.9, 0.9, 1.0)


class LiveBodies(SampledSystem):
    """System that draws the bodies of a plant, as Drake's MeshcatVisualizer does, which sends all anew each time.

    Input ports:
        query: Query object of the scene graph.
    """

    def __init__(self, meshcat: Meshcat, shown: dict[str, object], period: float) -> None:
        """Declares the events, one picture in each period of simulated time, [s].

        Shapes shown, by their path, are kept up to date, and shared by the systems of one Meshcat.
        """
        super().__init__()
        self._meshcat, self._shown = meshcat, shown
        self._query = cast(Source[QueryObject], self.DeclareAbstractInputPort("query", Value(QueryObject())))
        self.DeclareInitializationPublishEvent(self._draw)
        self.DeclarePeriodicPublishEvent(period, 0.0, self._move)

    def _draw(self, context: Context) -> None:
        query = self._query.Eval(context)
        inspector = query.inspector()
        shapes: dict[str, tuple[object, ...]] = {}
        for frame in inspector.GetAllFrameIds():
            path = _name(inspector, frame)
            ids = inspector.GetGeometries(frame, Role.kIllustration)
            if not ids:
                continue
            parts = [(inspector.GetShape(each), _find_colour(inspector, each)) for each in ids]
            poses = [inspector.GetPoseInFrame(each) for each in ids]
            shapes[path] = tuple(
                (_identify(shape), str(colour), X_FG.GetAsMatrix34().tobytes())
                for (shape, colour), X_FG in zip(parts, poses, strict=True)
            )
            if self._shown.get(path) != shapes[path]:
                self._meshcat.Delete(path)
                for number, ((shape, colour), X_FG) in enumerate(zip(parts, poses, strict=True)):
                    self._meshcat.SetObject(f"{path}/{number}", shape, colour)
                    self._meshcat.SetTransform(f"{path}/{number}", X_FG)
        for path in set(self._shown) - set(shapes):
            self._meshcat.Delete(path)
        self._shown.clear()
        self._shown.update(shapes)
        self._move(context)

    def _move(self, context: Context) -> None:
        query = self._query.Eval(context)
        inspector = query.inspector()
        for frame in inspector.GetAllFrameIds():
            if (path := _name(inspector, frame)) in self._shown:
                self._meshcat.SetTransform(path, query.GetPoseInWorld(frame))
        self._meshcat.SetSimulationTime(context.get_time())


def _name(inspector: SceneGraphInspector, frame: FrameId) -> str:
    return f"{_PREFIX}/{inspector.GetName(frame).replace('::', '/')}"


def _find_colour(inspector: SceneGraphInspector, geometry: Any) -> Rgba:
    properties = inspector.GetIllustrationProperties(geometry)
    return cast(Rgba, properties.GetPropertyOrDefault("phong", "diffuse", _GREY))


def _identify(shape: Shape) -> object:
    """Returns what tells a shape from others: its text, and of a mesh without a file its content."""
    if isinstance(shape, Mesh) and shape.source().is_in_memory():
        return shape.source().in_memory().mesh_file.contents()
    return repr(shape)
