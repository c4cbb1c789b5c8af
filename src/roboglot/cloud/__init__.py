"""The reference cloud of block programs (0.2.1.3): a separate HTTP server, which `roboglot cloud` runs.

Robots post what happens on them and fetch their account's favourites. Knows accounts and documents, no robot.
"""
