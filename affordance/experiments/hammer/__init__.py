"""Simulation IV: choosing a grip for hammering."""
