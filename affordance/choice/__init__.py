"""Choice of an object and a grip: options, their costs, and their ranking."""
