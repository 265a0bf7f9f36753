"""What a running robot holds now: from a stream of joint states, without a command to the robot."""
