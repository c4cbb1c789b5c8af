"""What `roboglot doctor` examines besides packages: who listens where, and what is open to whom."""
