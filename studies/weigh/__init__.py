"""Study of loads weighed by a wrist sensor, on simulated poses with known truth."""
