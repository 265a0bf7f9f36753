"""Commands for live views; each module has ``run``, and ``arguments`` declares their arguments."""
