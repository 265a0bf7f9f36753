"""Study of identified payloads, on simulated recordings and on recordings of two real robots."""
