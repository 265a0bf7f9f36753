"""Studies of how far results can be trusted, and of their cost at scale; ``make trust`` runs all of them."""
