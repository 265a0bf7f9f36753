"""Model predictive control of the arm, the motions that it follows, and its systems."""
