"""The paper's simulations with each learner, side by side: what changes, and what does not."""
