"""Comparative measurements; ``make bench`` runs them."""
