"""What is believed: of densities, of materials, of one object."""
