"""Pictures and sound in common formats: H.264, JPEG, MP4, Opus. Knows the model's values, no robot body.

Importing this package is cheap: PyAV is loaded with the first encoder.
"""
