"""File access: location of the models, readers with bounds on size, and atomic writing."""
