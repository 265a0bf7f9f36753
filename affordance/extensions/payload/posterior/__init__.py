"""Posterior of a payload: priors, fits, samples, and a description in words."""
