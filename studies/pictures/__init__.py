"""Study of measuring objects in photographs and synthetic images."""
