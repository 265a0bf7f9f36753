"""Studies: evidence about the library, produced in a clone of the repository; they import it, never the reverse."""
