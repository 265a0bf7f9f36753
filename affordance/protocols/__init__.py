"""Protocols of experiments as files: what they hold, what they mean, and what is measured."""
