"""Simulated and human participants: closed-form lifts, predictions, and fits of learners to lift forces."""
