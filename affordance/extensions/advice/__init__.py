"""Advice on tools: expected inertia, choice, and objects to hold next."""
