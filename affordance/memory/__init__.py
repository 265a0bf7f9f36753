"""Lasting memory: a ledger of evidence with one record per trial, from which any learner's belief is recomputed."""
