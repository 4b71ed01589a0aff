"""Who may say what: certificates of computers, what each may do on the bus, and how keys reach them."""
