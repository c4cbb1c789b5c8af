"""Commands for block programs and lessons."""
