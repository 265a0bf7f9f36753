"""Subcommands, in one module each with a function ``run``.

``arguments.py`` declares their arguments.

``run`` returns the exit status. Invalid arguments and files raise an AffordanceError with a one-line message before
anything is written.
"""
