"""Chapter "delivery": orders, boxes, stages and settings of the delivery service."""
