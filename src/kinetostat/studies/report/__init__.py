"""All that a report says of a machine, asked of the other studies. Nothing is written here."""
