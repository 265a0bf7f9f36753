"""The memory of materials, as a system."""

from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import Context

from affordance.memory import MaterialMemory
from affordance.systems.sampled_system import SampledSystem
from affordance.visual_prior import ObjectBelief


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
        self._posterior = self.DeclareAbstractInputPort("posterior", Value[object]())
        self._memory = self.DeclareAbstractState(AbstractValue.Make(MaterialMemory()))
        self.DeclareStateOutputPort("materials", self._memory)

    def set_memory(self, context: Context, memory: MaterialMemory) -> None:
        """Sets what is believed when a trial begins."""
        context.SetAbstractState(self._memory, memory)

    def get_memory(self, context: Context) -> MaterialMemory:
        """Returns what is believed now."""
        memory: MaterialMemory = context.get_abstract_state(self._memory).get_value()
        return memory

    def learn(self, context: Context) -> None:
        """Ends a trial: the posterior becomes what is believed.

        Whatever is to be read off the trial's beliefs must be read before, for the prior changes with the memory.
        """
        posterior: ObjectBelief = self._posterior.Eval(context)
        context.SetAbstractState(self._memory, posterior.memory)
