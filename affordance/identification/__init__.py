"""Identification of a held payload from the recordings of a real robot."""
