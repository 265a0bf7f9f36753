"""Figures, replays, pages and statistics."""
