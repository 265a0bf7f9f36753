"""Experiments on the accuracy of features from images."""
