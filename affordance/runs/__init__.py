"""Execution of repeats, in processes or on a cluster, and storage of their results."""
