"""Study of model and parameter recovery from pushes of simulated participants."""
