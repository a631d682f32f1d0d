"""The processes of the service, put together: the one that moves drives, and its fronts."""
