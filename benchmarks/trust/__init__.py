"""Studies of the trustworthiness of results and of their cost at scale; run all of them with ``make trust``."""
