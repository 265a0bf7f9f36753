"""How far loads weighed by a wrist sensor can be trusted: simulated poses, whose truth is known."""
