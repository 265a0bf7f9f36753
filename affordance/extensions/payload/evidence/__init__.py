"""Evidence of a loaded run: its samples with the empty arm accounted for, and the likelihood of a payload."""
