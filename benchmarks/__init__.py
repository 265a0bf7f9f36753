"""Comparative measurements; run them with ``make bench``."""
