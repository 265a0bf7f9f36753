"""Computes the posterior of a payload: prior, fit, samples and summary."""
