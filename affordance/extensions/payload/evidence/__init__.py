"""Builds the evidence of a loaded run, without the empty arm, and the likelihood of a payload."""
