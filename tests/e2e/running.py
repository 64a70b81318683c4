# SPDX-License-Identifier: Apache-2.0
"""What the end-to-end tests share: the time limit of a command, and a signal at a moment that is not left to chance."""
import fcntl
import json
import os
import signal
import subprocess

# Of one command: only a hang takes so long, on whatever machine and however loaded. (tests/CMakeLists.txt has those of
# the tests.)
HANG_S = 3600


def signal_at(arguments, wanted, number, environment=None):
    """Runs with --progress json and sends the signal at the first event that is wanted; returns all events that came,
    the other lines of standard error, and the status.

    The events come through a pipe that holds one of them (a packet pipe of one page): the program waits in
    the second event after the last one read here, so it cannot end before the signal, however fast it is.
    """
    events_in, events_out = os.pipe2(os.O_DIRECT | os.O_CLOEXEC)
    fcntl.fcntl(events_out, fcntl.F_SETPIPE_SZ, 4096)
    process = subprocess.Popen([*map(str, arguments), "--progress", "json"], stderr=events_out,
                               stdout=subprocess.DEVNULL, env=environment)
    os.close(events_out)
    events, others, sent = [], [], False
    with open(events_in, "rb") as lines:
        for line in lines:
            if not line.startswith(b"{"):
                others.append(line.decode())
                continue
            events.append(json.loads(line))
            if not sent and wanted(events[-1]):
                process.send_signal(number)
                sent = True
                if number == signal.SIGKILL:
                    break
        status = process.wait(timeout=HANG_S)  # before the pipe is closed: a failing write would be another end
    assert sent, "the event did not come: " + "".join(others)
    return events, others, status
