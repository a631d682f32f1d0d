"""Parts of every simulated node: SDO server, PDOs, NMT, errors, habits. Knows no family."""
