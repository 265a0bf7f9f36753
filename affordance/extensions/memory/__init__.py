"""Lasting memory of what robots have held, in an SQLite file."""
