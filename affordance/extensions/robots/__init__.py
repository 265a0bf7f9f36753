"""Import of any arm from its file."""
