"""Interfaces of what people meet: speaker, lights, skin, blaster, members, remote control."""
