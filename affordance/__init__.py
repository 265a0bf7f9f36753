"""Visual inertial affordances: see an object, guess its inertia, hold it, feel it, guess better."""
