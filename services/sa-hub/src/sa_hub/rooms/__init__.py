"""Soldiers' maps of rooms between computers: over broadband only, sealed, beside the radio's frames."""
