"""What the `bootprint` command does, one module a subject."""
