"""Ways for a frame to leave this computer; each gives whole datagrams, unchanged or not at all."""
