"""Posterior of a payload: priors of bodies and seen objects, fits, samples, and the belief in words."""
