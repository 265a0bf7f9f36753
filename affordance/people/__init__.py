"""Learners fitted to the lifts of single people."""
