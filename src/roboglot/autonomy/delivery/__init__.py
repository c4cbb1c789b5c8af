"""The delivery service: orders, rules, rounds, handovers, and the industry's call buttons."""
