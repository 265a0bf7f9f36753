"""Simulation: the Diagram, its trials, and the cost of a task when the motion is simulated."""
