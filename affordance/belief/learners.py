"""Initial memories of the learners."""

from affordance.arguments import Seed, check_member, check_seed
from affordance.belief.kind_memory import KindMemory, KindSettings
from affordance.belief.kinds_gate import GateSettings
from affordance.belief.learner import Learner, Pick
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import Memory

# Breadth of a category over its mean density, fitted to two groups of people, once for each way to pick: 0.229, 95 %
# interval 0.199 to 0.256, and 0.269, 0.212 to 0.309 (`affordance fit-kappa`; docs/decisions/0026-kinds.md).
KAPPA = {Pick.MAP: 0.23, Pick.DRAWN: 0.27}


# The default for a working arm: an odd object does not spoil the belief about its material, and without odd objects
# it behaves as a learner with one density for each colour (docs/decisions/0026-kinds.md).
ARM_LEARNER = Learner.KINDS_MAP


def start_memory(learner: Learner | str = Learner.DENSITY, seed: Seed = 0, kappa: float | None = None) -> Memory:
    """Builds the memory of an observer without experience.

    Args:
        learner: Learner, or its name.
        seed: Seed of the random choices of a learner that draws, different for each observer.
        kappa: Breadth of a category over its mean density; None for the fitted one.

    Raises:
        BadArgumentError: The learner does not exist, the seed is invalid, or kappa is not positive.
    """
    pick, seed = check_member("learner", learner, Learner).pick, check_seed(seed)
    if pick is None:
        return MaterialMemory()
    return KindMemory(KindSettings(GateSettings(KAPPA[pick] if kappa is None else kappa), pick, seed))
