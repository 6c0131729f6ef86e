"""All answers that a report on a machine needs, collected from the other studies. Nothing is written here."""
