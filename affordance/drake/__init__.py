"""Drake as the operating system provides it: libraries, off-screen renderer, base of our systems."""
