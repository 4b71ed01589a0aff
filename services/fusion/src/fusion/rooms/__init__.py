"""Maps of rooms (METHODS D5b): drawn from one's own walk, kept, and used of others to hold one's own walk."""
