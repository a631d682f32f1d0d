"""Events of the plant as OPC UA events, told and kept."""
