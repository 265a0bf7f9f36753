"""Protocols of experiments as files: their contents, their meaning, and the numbers that they measure."""
