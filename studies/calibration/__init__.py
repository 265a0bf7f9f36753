"""Study of whether an observer is as uncertain as it should be, and of how much its choices depend on its sensing."""
