"""Proprioception: measured joint torques, and the inference about the held object from them."""
