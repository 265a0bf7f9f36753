"""Lasting memory: a ledger of evidence, one record a trial, from which the belief of any learner is recalled."""
