"""Proprioception: measured joint torques, and the inference from them about the object in the hand."""
