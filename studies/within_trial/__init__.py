"""Narrowing of the posterior within a trial, and an arm that uses it during the trial."""
