"""Weighs loads with a force-torque sensor at rest, without a robot's file or Drake."""
