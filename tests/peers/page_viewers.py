"""Browsers that look at the page of a drive, without drawing it.

page_viewers.py PORT VIEWERS NODE/DRIVE
Each shows the plant and the drive and follows six of its values. They give way to everything else: where
they run in a plant is not on the box.
"""

import http.client
import json
import os
import sys
import threading
from itertools import islice

from websockets.sync.client import ClientConnection, connect

FOLLOWED = 6

port, viewers, drive = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]


def get(path: str, cookie: str) -> tuple[dict[str, object], str]:
    """What it answers, and the cookie that it gives."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    connection.request("GET", path, headers={"Cookie": cookie} if cookie else {})
    answer = connection.getresponse()
    given = (answer.getheader("set-cookie") or "").partition(";")[0]
    told = json.loads(answer.read())
    connection.close()
    return told, given


def look() -> ClientConnection:
    who, cookie = get("/api/session", "")
    site, _ = get("/api/site", cookie)
    leaves = site["natures"][site["places"][drive]]
    names = (f"{drive}/{leaf}" for leaf, one in leaves.items() if one["type"] == "float")
    headers = {"Cookie": cookie}
    origin = f"http://127.0.0.1:{port}"
    socket = connect(f"ws://127.0.0.1:{port}/live", origin=origin, additional_headers=headers, legacy=True)
    socket.send(who["token"])
    socket.send(json.dumps({"show": ["plant", f"drive {drive}"]}))
    socket.send(json.dumps({"trend": list(islice(names, FOLLOWED))}))
    return socket


def drain(socket: ClientConnection) -> None:
    for _ in socket:
        pass


os.nice(19)
sockets = [look() for _ in range(viewers)]
threads = [threading.Thread(target=drain, args=(socket,), daemon=True) for socket in sockets]
for thread in threads:
    thread.start()
print("they look", flush=True)
for thread in threads:
    thread.join()
