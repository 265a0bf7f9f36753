"""Whether results can be trusted, and what they cost at scale; run all of it with ``make trust``."""
