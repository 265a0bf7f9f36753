"""Studies that validate the library. They require a clone of the repository."""
