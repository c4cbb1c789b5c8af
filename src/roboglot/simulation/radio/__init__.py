"""Radio in the world: path loss, and Bluetooth devices that robots can hear."""
