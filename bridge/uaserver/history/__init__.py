"""History (OPC 10000-11): what keeps it, as a protocol, and HistoryRead."""
