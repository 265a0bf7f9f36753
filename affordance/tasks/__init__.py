"""Tasks: each states its goal, and what is measured of it."""
