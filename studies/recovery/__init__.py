"""Whether learners and their parameters are recovered from the pushes of simulated people."""
