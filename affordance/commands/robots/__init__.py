"""Commands for robots; each module has ``run``, and ``arguments`` declares their arguments."""
