"""Bytes in, readings out: pure, one module a protocol. Every oddity of a protocol ends here."""
