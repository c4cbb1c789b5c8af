"""The commands of the EP's plain-text SDK, one file per chapter of the manual."""
