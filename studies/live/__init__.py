"""What a live identification notices, how soon, and how often its intervals hold the truth."""
