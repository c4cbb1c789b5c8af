"""The service definition and what grpcio-tools generated from it (docs/protocols/cyberdog.md says how)."""
