"""Linear++: the family weighs in proportion to size, one of its size weighs two thirds more.

The program of both groups is ``linear.py``.
"""

from functools import partial

from affordance.experiments import linear

OBSERVERS, NO_MEMORY, EVERY_LEARNER = linear.OBSERVERS, linear.NO_MEMORY, linear.EVERY_LEARNER

run, read, predict = (partial(each, "linear_plus_plus") for each in (linear.run, linear.read, linear.predict))
