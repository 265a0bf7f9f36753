"""Commands for people; each module has ``run``, and ``arguments`` declares their arguments."""
