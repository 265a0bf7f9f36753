"""Tests if learners and parameters can be recovered from simulated people's pushes."""
