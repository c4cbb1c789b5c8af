"""Functions that move the dog: motions, walking, navigation, following, choreography."""
