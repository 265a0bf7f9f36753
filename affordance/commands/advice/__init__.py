"""Commands for advice. Each module has ``run``, and ``arguments`` declares their arguments."""
