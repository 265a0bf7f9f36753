"""Weighs loads on a force-torque sensor from poses, without a robot's file or Drake."""
