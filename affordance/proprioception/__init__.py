"""What the joints measure, and what it says of the object in the hand."""
