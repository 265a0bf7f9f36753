"""Study of the paper's claims across the arms of many robots."""
