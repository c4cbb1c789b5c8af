"""External inputs other than requests at doors, noted and repeated; fairness between clients and robots."""
