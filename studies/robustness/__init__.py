"""Study of robustness: tests every claim in a sample of assumptions.

The paper does not state these values.
"""
