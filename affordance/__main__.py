"""Entry point of ``python -m affordance``: the command line."""

import sys

from affordance.cli import main

sys.exit(main())
