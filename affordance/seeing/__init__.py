"""From a colour and depth picture of a presented object to its features, one step a file."""
