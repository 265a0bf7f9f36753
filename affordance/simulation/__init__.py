"""Simulation: the Diagram, its trials, and the costs of simulated motions."""
