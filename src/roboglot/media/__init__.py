"""Pictures and sound as the world outside wants them: H.264, JPEG, MP4, Opus. Knows the model's values, no robot body.

Importing this package is cheap: PyAV is loaded by the first encoder that is made.
"""
