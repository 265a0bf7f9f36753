"""Import of arms from robot files: reads leniently, writes clean arms that strict parsers accept."""
