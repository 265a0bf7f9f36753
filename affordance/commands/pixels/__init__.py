"""Commands for pictures; each module has ``run``, and ``arguments`` declares their arguments."""
