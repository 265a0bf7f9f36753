"""Identification: from what a real robot recorded to a belief about what it held."""
