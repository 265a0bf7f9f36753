"""Runs repeats in processes or on a cluster, and stores their results."""
