"""Real tools: inertia from meshes, first touch, sight, records of other people, and which end to hold."""
