"""Identification of a running robot's load from a stream of joint states; the robot gets no command."""
