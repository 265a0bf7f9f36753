"""Tests whether learners and their parameters can be recovered from the pushes of simulated people."""
