"""Visual features of objects, and the prior of their inertia computed from them."""
