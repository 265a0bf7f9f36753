"""Fits learners to the lifts of individual people."""
