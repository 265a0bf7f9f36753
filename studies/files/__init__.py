"""Study of robots' files: what an import makes of a folder of them."""
