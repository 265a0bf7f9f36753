"""Comparison of finished runs: of the choices for both tasks, and of both sources of features."""
