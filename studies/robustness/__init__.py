"""The multiverse: every claim over a sample of all that the paper does not give."""
