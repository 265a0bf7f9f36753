"""Design of motions that show a payload well: prediction of what they show, their limits, and the search."""
