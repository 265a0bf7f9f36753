"""Protocols of experiments as files: their contents, their meaning, and the numbers that they measure."""

# The group of all objects, which every protocol has.
ALL = "all"
