"""The codes of CyberDog 2's app protocol, one package per group of the manual's chapters."""
