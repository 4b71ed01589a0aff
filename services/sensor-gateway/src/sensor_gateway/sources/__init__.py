"""Where bytes and recorded messages come from: serial ports, UDP sockets, replay."""
