"""Experiments, one file each, and their shared parts.

These are observers in processes, lifts, results and drawings.
"""
