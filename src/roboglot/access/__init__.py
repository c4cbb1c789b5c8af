"""Access control: people, machines, addresses, their rights on robots, and an audit of their actions."""
