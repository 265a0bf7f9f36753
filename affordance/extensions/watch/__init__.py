"""Observers, live in the browser."""
