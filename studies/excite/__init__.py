"""Study of how to move: designs of motions against one another, by the errors that are found with them."""
