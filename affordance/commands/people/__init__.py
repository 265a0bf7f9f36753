"""Commands for experiments with people. Each module has ``run``, and ``arguments`` declares their arguments."""
