"""Experiments that people have done, and what they did."""
