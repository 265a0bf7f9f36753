"""Commands for pictures. Each module has ``run``, and ``arguments`` declares their arguments."""
