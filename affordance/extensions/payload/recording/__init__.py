"""Reads recordings in several formats, and computes evenly spaced, filtered samples."""
