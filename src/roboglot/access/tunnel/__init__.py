"""Vendors' ports of one robot over one TLS 1.3 connection: ``roboglot connect`` and its gateway."""
