"""Visual features from colour and depth pictures."""
