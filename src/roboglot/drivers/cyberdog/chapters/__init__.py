"""Components of a CyberDog, by the groups of chapters as in ``protocols.cyberdog.chapters``."""
