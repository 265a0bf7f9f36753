"""Simulated experiments, one per file, and their shared functions."""
