"""What single commands do on a bus."""
