"""The demo site: `drivebridge demo` serves it on simulated drives."""
