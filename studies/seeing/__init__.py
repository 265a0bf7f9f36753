"""How accurate features from pictures are."""
