"""One grip of the stick, whose materials are known, and a path that is out of reach, for tests of tasks."""

from affordance.belief.material_memory import MaterialMemory
from affordance.choice.listed_options import list_drawn_options
from affordance.choice.options import Option
from affordance.control.timed_path import TimedPath, load_path
from affordance.files.model_folder import MODELS
from affordance.objects.tool import list_densities
from affordance.settings import Settings
from helpers.two_tools import STICK

SETTINGS = Settings()
HELD = STICK.gripped_by(STICK.grips[0])
KNOWN = MaterialMemory.from_densities(list_densities([STICK]))
START = load_path(MODELS / "paths" / "reach.yaml").start
FAR = TimedPath(points=((0.5, 0.0, 0.3),), duration=1.0, tolerance=0.02, start=START)


def list_one() -> list[Option]:
    """Lists the first grip of the stick, as it is drawn."""
    return list_drawn_options([STICK])[:1]
