"""Payloads of simulated robots, whose truth is known, and the methods of others side by side."""
