"""Visual features of objects, and the resulting prior over their inertia."""
