"""Commands of this branch; each module has ``add_arguments`` and ``run``."""
