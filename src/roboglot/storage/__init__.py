"""What survives a crash: an SQLite file with places, maps, programs and settings."""
