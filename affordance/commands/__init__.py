"""Subcommands, one module each, defining add_arguments and run; cli.py finds them by name.

``run`` returns the exit status. Invalid arguments and files raise an AffordanceError, of one line, before anything is
written.
"""
