"""Identifies the payload of a running robot from a stream of joint states.

No command is sent to the robot.
"""
