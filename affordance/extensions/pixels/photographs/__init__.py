"""Mass, centre and form of an object in a colour and depth picture from a camera of your own."""
