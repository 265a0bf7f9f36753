"""Subcommands: one module each, which defines add_arguments and run. cli.py imports them by name.

``run`` returns the exit status. Invalid arguments and files raise an AffordanceError with a one-line message before
anything is written.
"""
