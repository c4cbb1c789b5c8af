"""What goes over the wire, by the groups of chapters as in ``protocols.cyberdog.chapters``."""
