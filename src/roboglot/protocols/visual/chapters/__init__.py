"""The frames of visual programming by type: tasks, modules, inquiries."""
