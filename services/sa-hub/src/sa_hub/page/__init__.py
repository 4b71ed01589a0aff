"""The command post's page: a map in a browser, and the HTTP and WebSocket interface that it is made of."""
