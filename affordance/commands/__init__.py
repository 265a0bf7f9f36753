"""What `affordance NAME` runs, one module a command."""
