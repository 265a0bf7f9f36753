"""The task, as a system."""

from pydrake.systems.framework import Context

from affordance.systems.sampled_system import SampledSystem
from affordance.tasks.hold import Hold


class Task(SampledSystem):
    """Says what is to be done; the task is a parameter of the Context.

    Output ports:
        goal: The task, which computes its goal at any state.
    """

    def __init__(self) -> None:
        super().__init__()
        self._task = self.declare_object_parameter(Hold)
        self.declare_object_output("goal", self._task.get, {self._task.ticket})

    def set_task(self, context: Context, task: Hold) -> None:
        """Sets the task."""
        self._task.set(context, task)
