"""The memory that an observer begins with, by what learns."""

from affordance.belief.kind_memory import KindMemory, KindSettings
from affordance.belief.kinds_gate import GateSettings
from affordance.belief.learner import Learner, Pick
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import Memory

# Breadth of a category over its mean density, fitted to two groups of people, once for each way to pick: 0.229, 95 %
# interval 0.199 to 0.256, and 0.269, 0.212 to 0.309 (`affordance fit-kappa`; docs/decisions/0026-kinds.md).
KAPPA = {Pick.MAP: 0.23, Pick.DRAWN: 0.27}


# The default for an arm that is to work: an odd object does not spoil what is known of its material, and where all
# are honest it does what one density for each colour does (docs/decisions/0026-kinds.md).
ARM_LEARNER = Learner.KINDS_MAP


def start_memory(learner: Learner, seed: tuple[int, ...], kappa: float | None = None) -> Memory:
    """The memory of an observer before anything was met.

    Args:
        learner: What learns.
        seed: Determines what a learner that draws will draw; another one for each observer.
        kappa: Breadth of a category over its mean density; None for the fitted one.
    """
    pick = learner.pick
    if pick is None:
        return MaterialMemory()
    return KindMemory(KindSettings(GateSettings(KAPPA[pick] if kappa is None else kappa), pick, seed))
