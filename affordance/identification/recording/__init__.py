"""Recordings as users have them: files of runs, their columns, and even filtered samples of them."""
