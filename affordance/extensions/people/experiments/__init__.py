"""Experiments in which people or observers lift objects."""
