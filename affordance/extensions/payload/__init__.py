"""Identifies payloads from recordings of a robot, and designs motions for this purpose."""
