"""How long a step is: models, the person, quick turns."""
