"""Designs motions from which a payload can be identified: prediction, limits and search."""
