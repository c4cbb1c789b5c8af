"""The service definition and the code generated from it by grpcio-tools (docs/protocols/cyberdog.md says how)."""
