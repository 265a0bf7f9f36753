"""Visual features of objects, and the prior over their inertia that follows from them."""
