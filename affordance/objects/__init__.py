"""Objects as they are: inertia, materials, tools, colours."""
