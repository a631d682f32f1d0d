"""One bus of a site as a DBC file: what tools that listen on CAN need to show values with names.

``describe`` says what is on the bus, by the site file and the mapping files; ``bridge.dbc.write`` makes the
file of it and needs cantools, so it is imported by those alone who write one.
"""

from bridge.dbc.describe import describe as describe
from bridge.dbc.model import BusDescription as BusDescription
from bridge.dbc.model import Message as Message
from bridge.dbc.model import MessageSignal as MessageSignal
