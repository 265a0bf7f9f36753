"""The memory of materials, as a system."""

from typing import Any

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context

from affordance.memory import MaterialMemory
from affordance.object_belief import ObjectBelief
from affordance.systems.sampled_system import SampledSystem, Source


class MaterialMemorySystem(SampledSystem):
    """Keeps what is believed of all materials from trial to trial.

    Its state changes once a trial: ``learn``, called at the end, takes over the posterior (the teaching signal).

    Input ports:
        posterior: Belief after what was felt, ObjectBelief.

    Output ports:
        materials: MaterialMemory.
    """

    def __init__(self) -> None:
        super().__init__()
        self._posterior: Source[ObjectBelief] = self.declare_object_input("posterior")
        index = self.DeclareAbstractState(AbstractValue.Make(MaterialMemory()))
        self._memory = int(index)
        self.DeclareStateOutputPort("materials", index)

    def set_memory(self, context: Context, memory: MaterialMemory) -> None:
        """Sets what is believed when a trial begins."""
        context.SetAbstractState(self._memory, memory)

    def get_memory(self, context: Context) -> MaterialMemory:
        """Returns what is believed now."""
        value: Any = context.get_abstract_state(self._memory)
        memory: MaterialMemory = value.get_value()
        return memory

    def learn(self, context: Context) -> None:
        """Ends a trial: the posterior becomes what is believed.

        Whatever is to be read off the trial's beliefs must be read before, for the prior changes with the memory.
        """
        self.set_memory(context, self._posterior.Eval(context).memory)
