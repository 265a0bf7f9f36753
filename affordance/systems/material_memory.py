"""The memory of materials, as a system."""

from pydrake.common.value import Value
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from affordance.memory import MaterialMemory
from affordance.visual_prior import ObjectBelief


class MaterialMemorySystem(LeafSystem):
    """Keeps what is believed of all materials from trial to trial.

    Its state changes once a trial: ``learn``, called at the end, takes over the posterior (the teaching signal).

    Input ports:
        posterior: Belief after what was felt, ObjectBelief.

    Output ports:
        materials: MaterialMemory.
    """

    def __init__(self) -> None:
        LeafSystem.__init__(self)
        self._posterior = self.DeclareAbstractInputPort("posterior", Value[object](None))
        self._memory = self.DeclareAbstractState(Value[object](MaterialMemory()))
        self.DeclareStateOutputPort("materials", self._memory)
        self.DeclareForcedUnrestrictedUpdateEvent(self._update_memory)

    def set_memory(self, context: Context, memory: MaterialMemory) -> None:
        """Sets what is believed when a trial begins."""
        context.SetAbstractState(self._memory, memory)

    def get_memory(self, context: Context) -> MaterialMemory:
        """Returns what is believed now."""
        memory: MaterialMemory = context.get_abstract_state(self._memory).get_value()
        return memory

    def learn(self, context: Context) -> None:
        """Ends a trial: the posterior becomes what is believed."""
        learned = context.Clone().get_mutable_state()
        self.CalcForcedUnrestrictedUpdate(context, learned)
        context.get_mutable_state().SetFrom(learned)

    def _update_memory(self, context: Context, state: State) -> EventStatus:
        posterior: ObjectBelief = self._posterior.Eval(context)
        state.get_mutable_abstract_state(self._memory).set_value(posterior.memory)
        return EventStatus.Succeeded()
