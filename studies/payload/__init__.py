"""Study of identified payloads, on simulated recordings whose truth is known and on recordings of two robots."""
