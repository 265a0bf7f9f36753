"""The task, as a system."""

from pydrake.common.value import Value
from pydrake.systems.framework import AbstractParameterIndex, Context

from affordance.systems.sampled_system import SampledSystem
from affordance.tasks.hold import Hold


class Task(SampledSystem):
    """Says what is to be done; the task is a parameter of the Context.

    Output ports:
        goal: The task, which computes its goal at any state.
    """

    def __init__(self) -> None:
        super().__init__()
        self._task = self.DeclareAbstractParameter(Value[object]())
        self.DeclareAbstractOutputPort(
            "goal",
            lambda: Value[object](),
            self._calc_goal,
            prerequisites_of_calc={self.abstract_parameter_ticket(AbstractParameterIndex(self._task))},
        )

    def set_task(self, context: Context, task: Hold) -> None:
        """Sets the task."""
        context.get_mutable_abstract_parameter(self._task).set_value(task)

    def _calc_goal(self, context: Context, output: Value) -> None:
        output.set_value(context.get_abstract_parameter(self._task).get_value())
