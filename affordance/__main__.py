"""``python -m affordance`` is the command line."""

import sys

from affordance.cli import main

sys.exit(main())
