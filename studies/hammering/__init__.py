"""Study of hammering: forces at which the cheaper grip changes, another nail, and other swings to the same strike."""
