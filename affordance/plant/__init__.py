"""The arm, its tool and the nail: Drake's plant and its kinematics and dynamics."""
