"""Chapter "system": health, power, lights, network and the jack."""
