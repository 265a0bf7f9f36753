"""Advice on tools: what to expect of them, which to choose, what to hold next."""
