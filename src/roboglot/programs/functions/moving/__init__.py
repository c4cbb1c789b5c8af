"""What programs call to move the dog: motions, walking, navigation, following, choreography."""
