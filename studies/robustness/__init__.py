"""Robustness study: tests all claims for a random sample of assumptions that the paper does not state."""
