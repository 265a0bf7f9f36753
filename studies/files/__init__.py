"""Study of robots' description files: imports every file in a folder and records what happens."""
