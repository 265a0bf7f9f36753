"""Experiments of this branch."""
