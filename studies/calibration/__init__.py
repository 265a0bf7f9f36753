"""Study of the calibration of observers' uncertainty, and of choices with other sensing."""
