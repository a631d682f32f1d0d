"""drivebridge: a CANopen master for industrial drives, served as OPC UA, Modbus TCP and zenoh."""

__version__ = "0.1.0"
