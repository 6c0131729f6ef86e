"""Export of machines and results to other programs, and import of machines from them."""
