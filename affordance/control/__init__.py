"""Model predictive control of the arm: planner, tasks, planned motions and Drake systems."""
