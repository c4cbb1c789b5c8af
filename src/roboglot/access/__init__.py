"""Who may do what with which robot: people, machines, addresses, their rights, and a record of what they did."""
