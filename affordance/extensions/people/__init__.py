"""Simulated and real people: closed-form lifts, predictions, and fits of learners to pushes."""
