"""The body module scored: recorded walks, simulated people, each of its methods; and its page of the manual."""
