"""Experiments in which human or simulated participants lift objects."""
