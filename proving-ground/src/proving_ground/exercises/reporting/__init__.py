"""What people see of an exercise: the live table, score tables, plots, the report."""
