"""What the page is given beside the plant: buses, captures, the system."""
