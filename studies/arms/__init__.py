"""Study that tests the paper's claims on the arms of many robots."""
