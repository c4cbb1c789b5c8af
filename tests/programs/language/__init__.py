"""The checker, modules and the language guide."""
