"""Subcommands, one module each, defining HELP, add_arguments and run; cli.py finds them by name."""
