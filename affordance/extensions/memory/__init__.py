"""Lasting memory of objects that robots have held, in an SQLite file."""
