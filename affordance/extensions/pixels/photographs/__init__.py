"""Measures an object's mass, centre and form in your own colour and depth picture."""
