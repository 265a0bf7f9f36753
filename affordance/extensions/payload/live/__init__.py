"""Identifies a running robot's load from a stream of joint states.

The robot gets no command.
"""
