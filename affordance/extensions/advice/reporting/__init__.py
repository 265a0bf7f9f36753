"""Figures and texts of this branch."""
