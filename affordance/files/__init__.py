"""File access: location of the models, size-limited readers, and atomic writing."""
