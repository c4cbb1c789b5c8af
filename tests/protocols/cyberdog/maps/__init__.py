"""Maps and the tasks on them."""
