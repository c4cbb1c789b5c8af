"""How ROS 2 goes over Zenoh: names of topics, of nodes and of their ends, and what comes beside a message."""
