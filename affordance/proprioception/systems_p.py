"""Proprioception: what the joints feel."""
