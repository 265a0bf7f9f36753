"""The commands of the command line, a module each with HELP, add_arguments and run; cli.py finds them by name."""
