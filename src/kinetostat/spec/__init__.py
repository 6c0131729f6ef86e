"""The language of files: the vocabulary of machine files, reading, validation and messages. Knows no formula."""
