"""Which numbers of a machine as built explain what has been measured of it, and how surely."""
