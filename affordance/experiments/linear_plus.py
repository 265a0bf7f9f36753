"""Linear+: in a family whose weight is in proportion to size, one object weighs a third more than predicted.

The program of both groups is ``linear.py``.
"""

from functools import partial

from affordance.experiments import linear

OBSERVERS, NO_MEMORY, EVERY_LEARNER = linear.OBSERVERS, linear.NO_MEMORY, linear.EVERY_LEARNER

run, read, predict = (partial(each, "linear_plus") for each in (linear.run, linear.read, linear.predict))
