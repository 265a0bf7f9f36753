"""The study of identification on real recordings, read from users' own clones of public repositories."""
