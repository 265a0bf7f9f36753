"""Choice of an object and of a grip: options, their costs, and their ranking."""
