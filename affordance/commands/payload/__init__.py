"""Commands for payloads. Each module has ``run``, and ``arguments`` declares their arguments."""
