"""What the whole house costs, measured alike every time: start, bus, services by number of soldiers."""
