"""Drake and the operating system: libraries, off-screen renderer, and the base class of systems."""
