"""Figures, replays, reports and statistics of results."""
