"""Better machines: what may change, what is wanted, how it is searched, and what was found."""
