"""Study of simulated payloads with known truth, and a comparison with other methods."""
