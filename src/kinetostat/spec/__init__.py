"""What people write: the vocabulary of machine files, reading, validation and messages. Knows no formula."""
