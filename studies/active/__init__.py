"""Study of active choice: how many holds it takes until tools are chosen rightly, by what picks them."""
