"""Study of real tools: inertia from meshes, first touch, sight, other people's records, and the end to hold."""
