"""Which object to take and how to grip it: options, what they cost, and ranking them."""
