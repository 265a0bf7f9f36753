"""The task, as a system."""

from pydrake.systems.framework import Context

from affordance.systems.sampled_system import ObjectParameter, SampledSystem
from affordance.tasks.task import Task


class TaskSystem(SampledSystem):
    """Says what is to be done; the task is a parameter of the Context.

    Output ports:
        goal: The Task, which computes its goal at any state.
    """

    def __init__(self) -> None:
        super().__init__()
        self._task: ObjectParameter[Task] = self.declare_object_parameter()
        self.declare_object_output("goal", self._task.get, {self._task.ticket})

    def set_task(self, context: Context, task: Task) -> None:
        """Sets the task."""
        self._task.set(context, task)
