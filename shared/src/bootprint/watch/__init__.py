"""`bootprint watch`: a soldier's own picture on a small screen: where am I, who is near, what must I know."""
