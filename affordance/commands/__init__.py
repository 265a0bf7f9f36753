"""Subcommands, one module each, defining add_arguments and run; cli.py finds them by name."""
