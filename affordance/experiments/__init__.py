"""The experiments, one a file: a frozen configuration and a function that runs it."""
