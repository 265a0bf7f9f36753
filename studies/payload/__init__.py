"""Study of identification from simulated payloads with known truth, and a comparison with other methods."""
