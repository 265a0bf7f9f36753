"""Runs the paper's simulations, and writes numbers, figures and report, like ``affordance run``.

run_experiments.py [weight|com|reach|hammer|vision|all|FILE.py] [--repeats N] [--seed S] [--jobs J]
                   [--out DIR] [--robot DIR | --robot FILE --tip NAME] [--vision features|pixels] [--learner NAME]
                   [--fault NAME]
"""

import sys

from affordance.cli import main

if __name__ == "__main__":
    sys.exit(main(["run", *sys.argv[1:]], program="run_experiments.py"))
