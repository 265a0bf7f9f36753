"""Base class of Drake systems, off-screen renderer, and system libraries."""
