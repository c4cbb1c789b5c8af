"""Layer between a socket and a protocol: TLS, and limits of bytes and connections. Knows no protocol."""
