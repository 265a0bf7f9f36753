"""Study of the whole loop: an arm identifies pieces of stock, learns from them, and chooses tools."""
