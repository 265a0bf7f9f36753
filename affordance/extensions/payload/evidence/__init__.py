"""Evidence of a loaded run after removing the empty arm, and the likelihood of a payload."""
