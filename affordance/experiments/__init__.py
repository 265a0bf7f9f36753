"""Experiments, one file each, and what they share: observers in processes, lifts, results and drawings."""
