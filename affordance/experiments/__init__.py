"""Experiments, one per file: a frozen configuration, and methods that plan, run and evaluate it."""
