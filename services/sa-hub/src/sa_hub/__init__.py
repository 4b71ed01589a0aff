"""Tracks of the squad, and the radio that carries them: own frames, sealed, under a hard budget of bits."""
