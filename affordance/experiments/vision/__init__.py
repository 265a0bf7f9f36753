"""How well objects are seen."""
