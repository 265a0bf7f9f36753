"""Posterior of a payload: priors, fits, samples, and the belief in words."""
