"""Experiments that people have done, and their results."""
