"""The web page: the plant for people, served by a front of its own."""
