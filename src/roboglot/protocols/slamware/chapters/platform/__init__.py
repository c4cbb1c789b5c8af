"""Chapter "platform": the system's time, and the events that clients collect."""
