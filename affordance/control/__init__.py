"""Model predictive control of the arm, the motions it follows, and its systems."""
