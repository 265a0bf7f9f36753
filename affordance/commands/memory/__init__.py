"""Commands for memories; each module has ``run``, and ``arguments`` declares their arguments."""
