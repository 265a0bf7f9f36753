"""Visual inertial affordances: see an object, predict its inertia, hold it, feel it, update the prediction.

Names are imported when first used, so that the command line can report missing libraries if Drake cannot be imported.
"""

import lazy_loader

from affordance.version import __version__ as __version__

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
