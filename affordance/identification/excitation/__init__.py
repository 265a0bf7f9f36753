"""Motions that show a payload well: what they will show, their limits, and the search for them."""
