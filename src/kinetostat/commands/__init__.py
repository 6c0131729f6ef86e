"""A module for each larger command of the command line, and what all commands share. No formula lives here."""
