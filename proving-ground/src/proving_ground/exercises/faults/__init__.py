"""What is broken in an exercise, by plan or by storm, and what became of it."""
