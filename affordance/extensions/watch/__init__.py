"""Live view of observers in the browser."""
