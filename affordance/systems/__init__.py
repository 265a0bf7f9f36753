"""Drake LeafSystems, one a file, each a thin shell around one pure module; diagram.py wires them."""
