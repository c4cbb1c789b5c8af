"""Requests of the CyberDog 2 as typed methods, by the groups of chapters as in ``protocols.cyberdog.chapters``."""
