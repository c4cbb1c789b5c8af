"""One numbered SQL file per version of the database; applied in order, never changed once released."""
