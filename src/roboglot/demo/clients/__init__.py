"""Independent clients, one per protocol: they know the vendor's wire and nothing of roboglot's insides."""
