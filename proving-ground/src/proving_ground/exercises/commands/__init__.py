"""`bootprint exercise …`: what there is to play, playing, comparing, repeating."""
