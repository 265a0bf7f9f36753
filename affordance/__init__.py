"""Visual inertial affordances: see an object, guess its inertia, hold it, feel it, guess better.

Names are imported at first use, so that the command line can say what is missing where Drake cannot be imported.
"""

import lazy_loader

from affordance.version import __version__ as __version__

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
