"""Is this installation sound? Its packages, its processor, known numbers. Libraries are imported when needed."""
