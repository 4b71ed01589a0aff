"""Exercises as real processes: routers, radio nets, services, what feeds them and what watches them."""
