"""What goes over the wire, by the chapters of the manual as in ``protocols.slamware.chapters``: schemas and formats."""
