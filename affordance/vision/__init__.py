"""Measures visual features of objects, and predicts inertia from them."""
