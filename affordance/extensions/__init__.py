"""Extensions beyond the paper, one folder each.

Without a folder, all others work except those that import it.
"""
