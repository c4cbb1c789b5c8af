"""ROS 2 over Zenoh: names of topics, of nodes and of their endpoints, and the attachment of a message."""
