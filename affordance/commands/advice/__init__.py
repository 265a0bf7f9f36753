"""Commands for advice; each module has ``run``, and ``arguments`` declares their arguments."""
