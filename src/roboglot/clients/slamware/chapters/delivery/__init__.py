"""Chapter "delivery": tasks, boxes and settings of the delivery service."""
