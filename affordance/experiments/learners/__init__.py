"""Comparison of the learners in the paper's simulations."""
