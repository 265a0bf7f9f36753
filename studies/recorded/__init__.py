"""Study of identification from real recordings, which are read from a user's clones of public repositories."""
