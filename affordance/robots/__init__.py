"""Any arm of any robot file: reading it leniently once, and writing a clean arm that the strict program takes."""
