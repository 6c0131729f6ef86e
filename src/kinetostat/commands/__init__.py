"""Commands of the command line that fill a file each, and what all of them share. No formula lives here."""
