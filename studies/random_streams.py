"""Seeds of independent random streams of studies, which differ from all seeds in the library's ``Stream``."""

import enum


@enum.unique
class StudyStream(enum.IntEnum):
    """Random stream of a study."""

    CALIBRATION_TRUTH = 10**6 + 11  # true densities (calibration/calibration.py)
    CALIBRATION_RANK = 10**6 + 12  # posterior samples for ranks of true densities (calibration/calibration.py)
    SETTINGS = 10**6 + 15  # settings of the robustness study
    ROBUSTNESS = 10**6 + 16  # permutations of these settings
    PROOF = 10**6 + 17  # settings for which the robustness study simulates all holds on request
