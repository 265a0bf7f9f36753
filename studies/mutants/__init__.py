"""Mutation testing: whether the tests notice the program broken in randomly drawn places."""
