"""Commands of the program. Each is a module with a function ``run``, and ``arguments.py`` declares their arguments.

``run`` returns the exit status. If an argument or file is invalid, it raises an AffordanceError with a one-line
message before anything is written.
"""
