"""Pictures of objects, from which features are detected and measured."""
