"""An OPC UA server on asyncua's codec, secure channel and node store. Of the bridge it knows nothing.

Sessions, subscriptions and the services are here; whom they serve is a ``ServedApplication``.
"""
