"""Published experiments with people, and their results."""
