"""Commands for memories. Each module has ``run``, and ``arguments`` declares their arguments."""
