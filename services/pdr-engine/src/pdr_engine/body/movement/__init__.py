"""How a person moves: class and direction of each step."""
