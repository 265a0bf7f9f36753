"""Running repeats, in processes or on a cluster, and keeping them."""
