"""Import of arms from robot files: a lenient reader, and a writer of clean arms that strict parsing accepts."""
