"""Visual features of objects, and the prior of their inertia that follows from them."""
