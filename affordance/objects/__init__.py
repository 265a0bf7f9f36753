"""Physical objects: inertia, materials, tools, colours."""
