"""The radio: what a frame says bit by bit, how it is sealed, when it is sent, and what it may cost."""
