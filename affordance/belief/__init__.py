"""Beliefs about densities, materials and objects."""
