"""What is known of places: furniture, appliances and vessels."""
