"""Features of objects, and the prior they give."""
