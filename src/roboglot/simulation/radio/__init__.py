"""Radio in the world: path loss, and Bluetooth devices in range of robots."""
