"""Arrays of many problems: rigid motions, and iterations."""
