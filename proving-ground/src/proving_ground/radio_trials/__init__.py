"""What the radio promises, tried on real hubs over emulated nets: delivery under loss, budgets, warnings."""
