"""The visual system of the paper's figure 2: features in, belief about the object's inertia out."""
