"""Study of the calibration of observers, and of choices with other measurement errors."""
