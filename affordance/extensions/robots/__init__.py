"""Imports robot arms from URDF, SDF and MJCF files, and compares such files."""
