"""Loads on a force-torque sensor, weighed from poses without a robot's file; nothing here imports Drake."""
