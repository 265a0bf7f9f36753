"""Commands for live views. Each module has ``run``, and ``arguments`` declares their arguments."""
