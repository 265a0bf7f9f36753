"""What goes beyond the paper, one folder each; without a folder all others work, but those that import it."""
