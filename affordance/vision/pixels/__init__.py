"""Features from colour and depth pictures."""
