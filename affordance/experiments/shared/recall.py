"""Memories that observers have of their experience."""

from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.memory_file import parse_memory
from affordance.belief.object_belief import Memory
from affordance.experiments.shared.experience import Experience


def recall(experience: Experience, repeat: int, num_trials: int) -> Memory:
    """Returns the memory of an observer after a number of trials."""
    if experience.memories.size:
        return parse_memory(bytes(experience.memories[repeat, num_trials]))
    precision, information_vector = experience.precision, experience.information_vector
    belief = DensityBelief(precision[repeat, num_trials], information_vector[repeat, num_trials])
    return MaterialMemory(experience.colours, belief)


def recall_all(experience: Experience, repeat: int) -> list[Memory]:
    """Returns the memories of an observer before the first and after each of K trials, K + 1 of them."""
    return [recall(experience, repeat, trial) for trial in range(experience.num_trials + 1)]
