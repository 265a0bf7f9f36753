"""The Diagram, its trials, and what a task costs when it is simulated."""
