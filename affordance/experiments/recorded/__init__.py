"""Study of identification on real recordings, read from the user's own clones of public repositories."""
