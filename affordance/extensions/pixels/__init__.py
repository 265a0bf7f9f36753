"""Pictures of objects: rendered, detected and measured, in place of true features."""
