"""Commands for payloads; each module has ``run``, and ``arguments`` declares their arguments."""
