"""Study of identified payloads, on simulated recordings and on recordings of two robots."""
