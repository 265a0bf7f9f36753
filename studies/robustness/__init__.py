"""Study of robustness: evaluates every claim in a sample of all values that the paper does not give."""
