"""CyberDog 2's app protocol: messages, codes and JSON for both ends. Knows no socket and no robot."""
