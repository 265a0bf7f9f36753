"""Files: where the models are, reading YAML, writing whole files."""
