"""Studies: evidence about the library, from a clone of the repository.

Studies import the library, never the reverse.
"""
