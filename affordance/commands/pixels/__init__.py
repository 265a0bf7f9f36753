"""Commands of this branch; each module has ``run``, and ``arguments`` declares their arguments."""
