"""Two neighbours of which one answers a message by hundreds at once, in the thread that also sends them.

Usage: many_answers.py DIRECTORY, for the sockets; fails unless the other one hears all of them.
"""

import sys
import threading

from network.links.transport import Links
from network.links.zenoh import ZenohTransport
from network.wire.messages import ConsensusMessage

N = 400


def says(sender, round_):
    return ConsensusMessage(sender, 0, round_, 1, (0.0,) * 28)


def main():
    asked, heard = [], []
    socket = f"unixsock-stream/{sys.argv[1]}/{{}}".format
    a, b = (
        ZenohTransport("run", name, Links((other,)), [socket(name)], [socket(other)], drop_late_pixels=False)
        for name, other in ("AB", "BA")
    )
    for each in (a, b):
        each.announce()
    a.wait_until_alive(["B"], 5.0)
    b.wait_until_alive(["A"], 5.0)

    def answer(message):
        asked.append(message.round)
        return [says("A", round_) for round_ in range(1, N + 1)]

    def hear(message):
        heard.append(message.round)
        return ()

    wait = threading.Thread(target=b.exchange, args=[hear, lambda: ("A",) if len(heard) < N else (), 5.0])
    wait.start()
    threading.Timer(0.2, b.send, [says("B", 1)]).start()
    a.exchange(answer, lambda: () if asked else ("B",), 5.0)
    wait.join()
    a.close()
    b.close()
    assert heard == list(range(1, N + 1)), f"heard {len(heard)} of {N}"


if __name__ == "__main__":
    main()
