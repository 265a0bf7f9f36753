"""Accuracy of features from pictures."""
