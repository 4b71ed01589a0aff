"""The foot INS scored: recorded runs, faults, what each choice is worth; its training and its page."""
