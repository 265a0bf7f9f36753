"""Study of weighing with a wrist sensor, on simulated poses with known loads."""
