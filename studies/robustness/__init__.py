"""Robustness: every claim is evaluated in a sample of all values that the paper does not give."""
