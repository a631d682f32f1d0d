"""What any part may need and knows nothing of drives: errors, the clock, limits and notices."""
