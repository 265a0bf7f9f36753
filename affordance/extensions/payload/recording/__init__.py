"""Reads recordings of users, and computes evenly spaced, filtered samples."""
