"""Recordings of users: readers of their files and columns, and evenly spaced, filtered samples."""
