"""Measurement of shape, position and mass of objects in your own colour and depth images."""
