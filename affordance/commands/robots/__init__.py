"""Commands for robots. Each module has ``run``, and ``arguments`` declares their arguments."""
