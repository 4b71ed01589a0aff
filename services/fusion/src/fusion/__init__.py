"""fusion: both boots and satellites into one position that knows how wrong it may be."""
