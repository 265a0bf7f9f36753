"""Study of the whole loop: a robot arm identifies pieces of stock, learns from them, and chooses tools."""
