"""The eye, as a system."""
