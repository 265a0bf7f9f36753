"""Designs motions from which a payload can be identified precisely."""
