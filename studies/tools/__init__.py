"""Study of real tools: inertia from meshes, first touch, vision, others' records, and which end to hold."""
