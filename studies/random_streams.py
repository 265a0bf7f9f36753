"""Seeds that separate the random draws of studies.

None equals one of the library's ``Stream``.
"""

import enum


@enum.unique
class StudyStream(enum.IntEnum):
    """Kind of a random draw in a study."""

    CALIBRATION_TRUTH = 10**6 + 11  # true densities (calibration/calibration.py)
    CALIBRATION_RANK = 10**6 + 12  # samples among which the truth is ranked (calibration/calibration.py)
    SETTINGS = 10**6 + 15  # settings of the study of robustness
    ROBUSTNESS = 10**6 + 16  # permutations of that study's settings
    PROOF = 10**6 + 17  # settings in which the study of robustness simulates every hold, if asked for
