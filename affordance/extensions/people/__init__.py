"""Simulated and real people: lifts in closed form, predictions for experiments, fits of learners to pushes."""
