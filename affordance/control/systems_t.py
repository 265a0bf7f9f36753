"""The task, as a system."""
