"""What a camera's picture shows, worked out from the world's geometry: one function for each kind of thing.

They see what is in the picture, near and large enough, turned the right way and not hidden; and not quite exactly.
"""
