"""Measurements of the program's speed, compared with other ways to compute the same; ``make bench`` runs them."""
