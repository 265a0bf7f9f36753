"""Arm, tool and nail: Drake's plant, its kinematics and its dynamics."""
